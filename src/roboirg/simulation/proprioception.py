"""What the robot feels: joints, fingers, and the tool's pose as continuous numbers."""

from __future__ import annotations

import math
from typing import TypedDict

import numpy as np
import sapien
from numpy.typing import NDArray

from roboirg.simulation.panda import Panda

LOCKED = 1e-7
"""Radians from straight up or down at which roll and yaw turn about one axis; yaw is 0 there."""


class ProprioceptiveState(TypedDict):
    """Proprioception at one moment; shapes and units as in a policy's observation."""

    joint_positions: NDArray[np.float32]
    gripper: NDArray[np.float32]
    end_effector: NDArray[np.float64]


class Proprioception:
    """Reads a robot; follows the tool's angles, so that they never jump by a full turn.

    Args:
        robot: to be followed from now on.
    """

    def __init__(self, robot: Panda) -> None:
        self._robot = robot
        self._angles = self._principal_angles()

    def follow(self) -> None:
        """To be called after every control step, whether or not anybody reads."""
        pairs = zip(self._angles.tolist(), self._principal_angles().tolist(), strict=True)
        self._angles = np.array([unwrapped(before, now) for before, now in pairs])

    def read(self) -> ProprioceptiveState:
        """The robot's state at the last step that was followed."""
        position = np.asarray(self._robot.tool_pose.p, dtype=np.float64)
        return {
            "joint_positions": self._robot.arm_positions.astype(np.float32),
            "gripper": self._robot.finger_positions.astype(np.float32),
            "end_effector": np.concatenate([position, self._angles]),
        }

    def _principal_angles(self) -> NDArray[np.float64]:
        """Roll, pitch and yaw of the tool, extrinsic x-y-z, rad."""
        return euler_angles(self._robot.tool_pose)


def unwrapped(before: float, now: float) -> float:
    """An angle without whole turns since before, rad: `numpy.unwrap`, for two numbers quicker."""
    change = now - before
    if abs(change) < math.pi:
        return now + 0.0
    short = (change + math.pi) % (2.0 * math.pi) - math.pi
    if short == -math.pi and change > 0.0:
        short = math.pi
    return now + (short - change)


def euler_angles(pose: sapien.Pose) -> NDArray[np.float64]:
    """Roll, pitch and yaw of a pose (extrinsic x-y-z), rad, each from -pi to pi.

    By the formulas of Bernardes and Viollet (2022), which SciPy uses too and with the same bits;
    importing SciPy would be a fifth of a process's start.
    """
    w, x, y, z = (float(number) for number in pose.q)
    # The order of the sum decides the last bit.
    norm = math.sqrt(x * x + y * y + z * z + w * w)
    w, x, y, z = w / norm, x / norm, y / norm, z / norm
    half_sum, half_difference = math.atan2(x + z, w - y), math.atan2(z - x, w + y)
    # NumPy's hypot is the C library's, which Python's is not.
    tilt = 2.0 * math.atan2(np.hypot(w + y, z - x), np.hypot(w - y, x + z))
    roll, yaw = half_sum - half_difference, half_sum + half_difference
    if tilt <= LOCKED:
        roll, yaw = 2.0 * half_sum, 0.0
    elif math.pi - tilt <= LOCKED:
        roll, yaw = -2.0 * half_difference, 0.0
    return np.array([_principal(angle) for angle in (roll, tilt - math.pi / 2.0, yaw)])


def _principal(angle: float) -> float:
    """The same angle from -pi to pi."""
    if abs(angle) <= math.pi:
        return angle
    return angle - math.copysign(2.0 * math.pi, angle)
