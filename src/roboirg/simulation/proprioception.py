"""Proprioception: joints, fingers, and the tool's pose with continuous angles."""

from __future__ import annotations

import math
from typing import TypedDict

import numpy as np
import sapien
from numpy.typing import NDArray

from roboirg.simulation.panda import Panda

LOCKED = 1e-7
"""Radians from gimbal lock within which yaw is set to 0."""


class ProprioceptiveState(TypedDict):
    """Proprioception at one moment; shapes and units as in a policy's observation."""

    joint_positions: NDArray[np.float32]
    gripper: NDArray[np.float32]
    end_effector: NDArray[np.float64]


class Proprioception:
    """Reads a robot's proprioception; unwraps the tool's angles so that they never jump."""

    def __init__(self, robot: Panda) -> None:
        self._robot = robot
        self._angles = self._principal_angles()

    def update(self) -> None:
        """Update the unwrapped angles; call after every control step."""
        pairs = zip(self._angles.tolist(), self._principal_angles().tolist(), strict=True)
        self._angles = np.array([unwrap_angle(before, now) for before, now in pairs])

    def read(self) -> ProprioceptiveState:
        """Return the robot's state at the last update."""
        position = np.asarray(self._robot.tool_pose.p, dtype=np.float64)
        return {
            "joint_positions": self._robot.arm_positions.astype(np.float32),
            "gripper": self._robot.finger_positions.astype(np.float32),
            "end_effector": np.concatenate([position, self._angles]),
        }

    def _principal_angles(self) -> NDArray[np.float64]:
        """Return roll, pitch and yaw of the tool, extrinsic x-y-z, rad."""
        return euler_angles(self._robot.tool_pose)


def unwrap_angle(before: float, now: float) -> float:
    """Unwrap an angle (rad) relative to the previous one, like `numpy.unwrap` but faster."""
    change = now - before
    if abs(change) < math.pi:
        return now + 0.0
    short = (change + math.pi) % (2.0 * math.pi) - math.pi
    if short == -math.pi and change > 0.0:
        short = math.pi
    return now + (short - change)


def euler_angles(pose: sapien.Pose) -> NDArray[np.float64]:
    """Return roll, pitch and yaw of a pose (extrinsic x-y-z), rad, each from -pi to pi.

    Uses the formulas of Bernardes and Viollet (2022), as SciPy does, and gives the same bits;
    importing SciPy would take a fifth of a process's startup time.
    """
    w, x, y, z = pose.q.tolist()
    # The order of the sum determines the last bit.
    norm = math.sqrt(x * x + y * y + z * z + w * w)
    w, x, y, z = w / norm, x / norm, y / norm, z / norm
    half_sum, half_difference = math.atan2(x + z, w - y), math.atan2(z - x, w + y)
    # NumPy's hypot is the C library's; Python's is not.
    tilt = 2.0 * math.atan2(np.hypot(w + y, z - x), np.hypot(w - y, x + z))
    roll, yaw = half_sum - half_difference, half_sum + half_difference
    if tilt <= LOCKED:
        roll, yaw = 2.0 * half_sum, 0.0
    elif math.pi - tilt <= LOCKED:
        roll, yaw = -2.0 * half_difference, 0.0
    return np.array([_principal(angle) for angle in (roll, tilt - math.pi / 2.0, yaw)])


def _principal(angle: float) -> float:
    """Wrap an angle to -pi to pi."""
    if abs(angle) <= math.pi:
        return angle
    return angle - math.copysign(2.0 * math.pi, angle)
