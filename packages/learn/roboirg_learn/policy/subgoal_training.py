"""What hands and planners learn from: recordings with the subgoal that is due at each decision.

A planner names subgoals, the hands are a network that follows them.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from roboirg.extension.commands import InvalidValueError
from roboirg_learn.policy.planner_history import (
    PLANNER_HISTORIES,
    PlannerHistory,
    ideal_planner_inputs,
    requests_for_hands,
)
from roboirg_learn.policy.policy_data import EpisodeArrays
from roboirg_learn.policy.policy_plan import HANDS, PLANNERS, Recorded
from roboirg_learn.policy.sight import ObjectClasses
from roboirg_learn.policy.subgoals import encode_request, recorded_subgoals

IS_VIDEO = 6
"""Column of `LookArrays.tool`: 1 if the look is one of the video, else 0."""


def with_planner_inputs(
    memory: str,
    recorded: Recorded,
    arrays: EpisodeArrays,
    templates: int,
    object_classes: ObjectClasses,
    rng: np.random.Generator,
) -> EpisodeArrays:
    """Return an episode with what a network of this memory is given and learns of subgoals.

    With ``"hands"`` it is the subgoal that is due at each decision, and no goal; for a planner it
    is what it would have named and kept before. For any other network nothing changes.

    Args:
        memory: of the network; a name of `MEMORIES`.
        recorded: the episode and its recording.
        arrays: the same as network input.
        templates: number of subgoal templates, for a planner.
        object_classes: classes of objects and their heights.
        rng: moves the points of subgoals, for hands.
    """
    if memory == HANDS:
        return _with_requests(recorded, arrays, object_classes, rng)
    if memory in PLANNERS:
        return _with_history(PLANNER_HISTORIES[memory](templates), arrays)
    return arrays


def _with_requests(
    recorded: Recorded,
    arrays: EpisodeArrays,
    object_classes: ObjectClasses,
    rng: np.random.Generator,
) -> EpisodeArrays:
    """Return an episode for hands: the subgoal due at each decision, and zeros as goal.

    Hands must not know the goal, so that they follow subgoals of any planner.

    Args:
        recorded: the episode and its recording.
        arrays: the same as network input.
        object_classes: classes of objects and their heights.
        rng: moves the points of subgoals a little.
    """
    stages_done = arrays.stages_done.tolist()
    subgoals = recorded_subgoals(recorded.recording, recorded.episode, stages_done, rng)
    requests = [_encode_known_request(subgoal, object_classes) for subgoal in subgoals]
    no_goal = np.zeros_like(arrays.goal)
    return arrays._replace(goal=no_goal, subgoal_inputs=requests_for_hands(requests))


def _with_history(history: PlannerHistory, arrays: EpisodeArrays) -> EpisodeArrays:
    """Return an episode for a planner: what it would have named and kept before each decision.

    Args:
        history: a new one of the planner's kind; it is filled.
        arrays: network input whose `moves` are numbers of subgoal templates.
    """
    looks_of_video = int(arrays.looks.tool[:, IS_VIDEO].sum())
    subgoal_inputs = ideal_planner_inputs(history, arrays.moves, arrays.decisions, looks_of_video)
    return arrays._replace(subgoal_inputs=subgoal_inputs)


def _encode_known_request(subgoal: str, object_classes: ObjectClasses) -> NDArray[np.float32]:
    """Return a subgoal in words as numbers for hands (REQUEST_SIZE,); see `encode_request`.

    Raises:
        InvalidValueError: its words are not understood.
    """
    found = encode_request(subgoal, object_classes)
    if found is None:
        raise InvalidValueError(f"The subgoal {subgoal!r} has no form that hands know.")
    return found
