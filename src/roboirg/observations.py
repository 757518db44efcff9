"""What a policy gets to see: one moment, and what was shown before."""

from __future__ import annotations

from typing import Any, TypedDict

import numpy as np
from numpy.typing import NDArray


class Observation(TypedDict):
    """What the robot sees and feels now.

    Pictures are uint8 (256, 256, 3), present for the cameras that the policy asks for.
    """

    front_rgb: NDArray[np.uint8]
    wrist_rgb: NDArray[np.uint8]
    joint_positions: NDArray[np.float32]
    """(7,) arm joint angles, rad."""
    gripper: NDArray[np.float32]
    """(2,) finger positions, m, 0 to 0.04."""
    end_effector: NDArray[np.float64]
    """(6,) x, y, z (m) and roll, pitch, yaw (rad, extrinsic x-y-z) of the tool centre, world."""
    instruction: str


Demonstration = dict[str, NDArray[Any]]
"""As `Observation` without the instruction, one more leading axis T: what was shown before.

T is 0 in tasks without a video. The frame that follows it is the first observation.
"""
