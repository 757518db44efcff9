"""What the robot feels: joints, fingers, and the tool's pose as continuous numbers."""

from __future__ import annotations

from typing import TypedDict

import numpy as np
from numpy.typing import NDArray

from roboirg.simulation.robot import Robot, rotation_of


class Feeling(TypedDict):
    """Proprioception at one moment; shapes and units as in a policy's observation."""

    joint_positions: NDArray[np.float32]
    gripper: NDArray[np.float32]
    end_effector: NDArray[np.float64]


class Proprioception:
    """Reads a robot; follows the tool's angles, so that they never jump by a full turn.

    Args:
        robot: to be followed from now on.
    """

    def __init__(self, robot: Robot) -> None:
        self._robot = robot
        self._angles = self._principal_angles()

    def follow(self) -> None:
        """To be called after every control step, whether or not anybody reads."""
        pair = np.stack([self._angles, self._principal_angles()])
        self._angles = np.unwrap(pair, axis=0)[1]

    def read(self) -> Feeling:
        """The robot's state at the last step that was followed."""
        position = np.asarray(self._robot.tool_pose.p, dtype=np.float64)
        return {
            "joint_positions": self._robot.arm_positions.astype(np.float32),
            "gripper": self._robot.finger_positions.astype(np.float32),
            "end_effector": np.concatenate([position, self._angles]),
        }

    def _principal_angles(self) -> NDArray[np.float64]:
        """Roll, pitch and yaw of the tool, extrinsic x-y-z, rad."""
        return np.asarray(rotation_of(self._robot.tool_pose).as_euler("xyz"))
