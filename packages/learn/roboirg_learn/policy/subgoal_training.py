"""What hands and planners learn from: recordings with the subgoal that is due at each decision."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from roboirg.extension.commands import InvalidValueError
from roboirg_learn.policy.planner_history import ideal_planner_inputs, requests_for_hands
from roboirg_learn.policy.policy_data import EpisodeNumbers
from roboirg_learn.policy.policy_plan import HANDS, KEYFRAME_PLANNER, PLANNERS, Recorded
from roboirg_learn.policy.sight import Sight
from roboirg_learn.policy.subgoals import encode_request, recorded_subgoals

IS_VIDEO = 6
"""Column in the numbers of the tool: 1 if the look is one of the video, else 0."""


def with_planner_inputs(
    memory: str,
    recorded: Recorded,
    numbers: EpisodeNumbers,
    forms: int,
    sight: Sight,
    rng: np.random.Generator,
) -> EpisodeNumbers:
    """Return an episode with the subgoals that hands or a planner are given.

    Episodes of other bodies are returned as they are.

    Args:
        memory: a name of `MEMORIES`.
        recorded: the episode and its recording.
        numbers: the same as network input.
        forms: number of forms of subgoals, for a planner.
        sight: classes of things and their heights.
        rng: moves the points of subgoals.
    """
    if memory == HANDS:
        done = numbers.done.tolist()
        subgoals = recorded_subgoals(recorded.recording, recorded.episode, done, rng)
        requests = requests_for_hands(
            [_encode_known_request(subgoal, sight) for subgoal in subgoals]
        )
        # Hands know what they are asked for, and no goal.
        return numbers._replace(goal=np.zeros_like(numbers.goal), planned=requests)
    if memory in PLANNERS:
        chooses = memory == KEYFRAME_PLANNER
        video = int(numbers.looks.tool[:, IS_VIDEO].sum())
        planned = ideal_planner_inputs(
            numbers.moves, numbers.decisions, video, forms, chooses=chooses
        )
        return numbers._replace(planned=planned)
    return numbers


def _encode_known_request(subgoal: str, sight: Sight) -> NDArray[np.float32]:
    """Return a subgoal as numbers for hands (REQUEST_SIZE,).

    Raises:
        InvalidValueError: its words have no known form.
    """
    found = encode_request(subgoal, sight)
    if found is None:
        raise InvalidValueError(f"The subgoal {subgoal!r} has no form that hands know.")
    return found
