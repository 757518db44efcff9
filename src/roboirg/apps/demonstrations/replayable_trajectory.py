"""What a dataset says of a trajectory that can be replayed, whatever its format."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from roboirg.core.actions import JOINT_ANGLE, CheckedActions


@dataclass(frozen=True, eq=False)
class ReplayableTrajectory:
    """What a dataset says of one trajectory.

    Attributes:
        name: of the trajectory, for messages.
        task: name of the task.
        seed: of the scene.
        split: of the episode; None if the dataset does not say, as RoboMME's.
        index: of the episode in the split; None likewise.
        actions: (n, size) that were executed, in a disturbed trajectory not those to learn.
        states: (n, 8) after each of the actions: joints (rad) and the first finger (m).
        final_state: (9,) joints and both fingers at the end; None if the dataset does not say.
        status: how it ended; RoboMME's are successes.
        space: name of the action space.
    """

    name: str
    task: str
    seed: int
    split: str | None
    index: int | None
    actions: CheckedActions
    states: NDArray[np.float64]
    final_state: NDArray[np.float64] | None
    status: str
    space: str = JOINT_ANGLE.name
