"""Replay a dataset: execute its actions in the simulator and compare states and verdicts."""

from __future__ import annotations

import functools
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from roboirg.apps.demonstrations.replayable_trajectory import ReplayableTrajectory
from roboirg.core.episode import SPLITS, Episode
from roboirg.core.errors import InvalidValueError
from roboirg.envs.factory import make
from roboirg.tasks.splits.splits import SIZES, get_episode

TOLERANCE = 1e-4
"""Largest difference (rad, m) of states that count as equal."""


@dataclass(frozen=True)
class ReplayResult:
    """What the replay of a trajectory gave.

    Attributes:
        name: of the trajectory.
        status: how the replay ended.
        recorded_status: how the trajectory ended.
        steps: executed actions.
        recorded_steps: actions of the trajectory.
        largest: difference of a joint (rad) or finger (m) after any action.
        final: difference after the last action; not a number if there is nothing to compare.
    """

    name: str
    status: str
    recorded_status: str
    steps: int
    recorded_steps: int
    largest: float
    final: float

    @property
    def agrees(self) -> bool:
        """Whether the verdict is the same and the final state within 1e-4."""
        return self.status == self.recorded_status and self.final <= TOLERANCE


def replay(recorded: ReplayableTrajectory) -> ReplayResult:
    """Execute a trajectory's recorded actions in the simulator, and measure how far states differ.

    Differences are between joint angles (rad) and finger positions (m), the largest of each step.
    Stops early if the episode ends before the actions do.
    """
    env = make(_find_episode(recorded), cameras=(), actions=recorded.space)
    differences = []
    final = float("nan")  # unknown if no action was executed, or no final state recorded
    try:
        env.reset()
        for action, expected in zip(recorded.actions, recorded.states, strict=True):
            observation, *_ = env.step(action)
            state = np.append(observation["joint_positions"], observation["gripper"])
            one_finger = state[:-1]  # as datasets have it; both fingers move alike
            differences.append(_difference(one_finger, expected))
            if env.status != "ongoing":
                break
        if differences and recorded.final_state is not None:
            final = _difference(state, recorded.final_state)
        status = "failure" if env.status == "ongoing" else env.status
    finally:
        env.close()
    return ReplayResult(
        name=recorded.name,
        status=status,
        recorded_status=recorded.status,
        steps=len(differences),
        recorded_steps=len(recorded.actions),
        largest=max(differences, default=0.0),
        final=final,
    )


def _difference(state: NDArray[np.floating[Any]], expected: NDArray[np.floating[Any]]) -> float:
    """Return the greatest absolute difference between two arrays of the same shape."""
    return float(np.abs(state.astype(np.float64) - expected).max())


def _find_episode(recorded: ReplayableTrajectory) -> Episode:
    """Return the episode of a trajectory, by its split and number or else by its seed.

    RoboMME's files have only the seed, by which it is looked up among train, val and test.

    Raises:
        InvalidValueError: no episode has the seed.
    """
    if recorded.split is not None and recorded.index is not None:
        return get_episode(recorded.task, recorded.split, recorded.index)
    place = _places(recorded.task).get(recorded.seed)
    if place is None:
        raise InvalidValueError(
            f"{recorded.name} has the seed {recorded.seed}; no episode of {recorded.task} has it."
        )
    return get_episode(recorded.task, *place)


@functools.cache
def _places(task: str) -> dict[int, tuple[str, int]]:
    """Return the split and the number in it of each episode of a task, by its seed.

    Of train, val and test: ``{510000: ("test", 0), …}``. Makes all of them once, and keeps them.
    """
    places = {}
    for split in SPLITS:
        for index in range(SIZES[split]):
            seed = get_episode(task, split, index).seed
            places[seed] = (split, index)
    return places
