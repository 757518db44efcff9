"""Proprioception: joints, fingers, and the tool's pose with continuous angles."""

from __future__ import annotations

import math
from typing import TypedDict

import numpy as np
import sapien
from numpy.typing import NDArray

from roboirg.simulation.panda import Panda

TURN = 2.0 * math.pi
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
        self._angles = unwrap_angles(self._angles, self._principal_angles())

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


def unwrap_angles(
    previous: NDArray[np.float64], angles: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Return angles plus full turns, each at most half a turn from the previous one; rad.

    For example 3.3 after 3.2 for an angle of -2.98. It is `numpy.unwrap`, to the last bit, which
    is asked only if an angle jumps, as it is slow.
    """
    if np.abs(angles - previous).max() < math.pi:
        return angles + 0.0  # no negative zero
    return np.asarray(np.unwrap([previous, angles], axis=0)[1])


def euler_angles(pose: sapien.Pose) -> NDArray[np.float64]:
    """Return roll, pitch and yaw of a pose (extrinsic x-y-z), rad, each from -pi to pi.

    Uses the formulas of Bernardes and Viollet (2022), as SciPy does, and gives the same bits, so
    that the order of operations matters; importing SciPy would take a fifth of a process's startup
    time. Where roll and yaw turn about the same axis (gimbal lock), yaw is 0.
    """
    w, x, y, z = pose.q.tolist()
    norm = math.sqrt(x * x + y * y + z * z + w * w)
    w /= norm
    x /= norm
    y /= norm
    z /= norm
    # Sums and differences of the unit quaternion's parts: a and b give half the sum of roll and
    # yaw, c and d half the difference, and their lengths the pitch.
    a = w - y
    b = x + z
    c = w + y
    d = z - x
    half_sum = math.atan2(b, a)
    half_difference = math.atan2(d, c)
    # NumPy's hypot is the C library's; Python's is not.
    tilt = 2.0 * math.atan2(np.hypot(c, d), np.hypot(a, b))
    pitch = tilt - math.pi / 2.0
    if tilt <= LOCKED:
        roll = 2.0 * half_sum
        yaw = 0.0
    elif math.pi - tilt <= LOCKED:
        roll = -2.0 * half_difference
        yaw = 0.0
    else:
        roll = half_sum - half_difference
        yaw = half_sum + half_difference
    return np.array([_principal(roll), _principal(pitch), _principal(yaw)])


def _principal(angle: float) -> float:
    """Return an angle from -pi to pi, given one that is at most a turn away from one."""
    if abs(angle) <= math.pi:
        return angle
    return angle - math.copysign(TURN, angle)
