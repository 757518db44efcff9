"""What the robot feels: joints, fingers, and the tool's pose as continuous numbers."""

from __future__ import annotations

from typing import TypedDict

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from roboirg.simulation.robot import Robot


class Feeling(TypedDict):
    """Proprioception at one moment; shapes and units as in a policy's observation."""

    joint_positions: NDArray[np.float32]
    gripper: NDArray[np.float32]
    end_effector: NDArray[np.float64]


class Proprioception:
    """Reads a robot; remembers the last angles, so that they never jump by a full turn."""

    def __init__(self, robot: Robot) -> None:
        self._robot = robot
        self._angles: NDArray[np.float64] | None = None

    def read(self) -> Feeling:
        """The robot's state now."""
        pose = self._robot.tool_pose
        w, x, y, z = np.asarray(pose.q, dtype=np.float64)
        angles = np.asarray(Rotation.from_quat([x, y, z, w]).as_euler("xyz"))
        if self._angles is not None:
            angles = np.unwrap(np.stack([self._angles, angles]), axis=0)[1]
        self._angles = angles
        return {
            "joint_positions": self._robot.arm_positions.astype(np.float32),
            "gripper": self._robot.finger_positions.astype(np.float32),
            "end_effector": np.concatenate([np.asarray(pose.p, dtype=np.float64), angles]),
        }
