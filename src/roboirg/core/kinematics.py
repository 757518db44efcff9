"""Forward kinematics of Franka's Panda and Research 3."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import ArrayLike, NDArray

from roboirg.core.episode import ROBOT_BASE

LINKS = (
    # d, m; a, m; alpha, rad, of each joint (Craig's convention); source: Franka's documentation.
    (0.333, 0.0, 0.0),
    (0.0, 0.0, -math.pi / 2),
    (0.316, 0.0, math.pi / 2),
    (0.0, 0.0825, math.pi / 2),
    (0.384, -0.0825, -math.pi / 2),
    (0.0, 0.0, math.pi / 2),
    (0.0, 0.088, math.pi / 2),
)
FLANGE_OFFSET = 0.107
"""From the last joint to the flange, m."""
TOOL_OFFSET = 0.1034
"""From the flange to the tool center between the fingertips, m."""
HAND_YAW = -math.pi / 4
"""Angle at which the hand is mounted, rad."""


def tool_pose(joints: ArrayLike) -> NDArray[np.float64]:
    """Return the pose (4, 4) of the tool center, robot base frame, m.

    Args:
        joints: angles (7), rad.
    """
    pose = np.eye(4)
    for angle, (offset, length, twist) in zip(
        np.asarray(joints, dtype=np.float64), LINKS, strict=True
    ):
        pose = pose @ _link(float(angle), offset, length, twist)
    return pose @ _link(HAND_YAW, FLANGE_OFFSET + TOOL_OFFSET, 0.0, 0.0)


def end_effector_pose(joints: ArrayLike) -> NDArray[np.float64]:
    """Return the pose (6) of the tool center, world frame.

    Args:
        joints: angles (7), rad.

    Returns:
        x, y, z (m) and roll, pitch, yaw (rad, extrinsic x-y-z), as in observations.
    """
    pose = tool_pose(joints)
    rotation = pose[:3, :3]
    pitch = math.asin(-min(max(float(rotation[2, 0]), -1.0), 1.0))
    roll = math.atan2(rotation[2, 1], rotation[2, 2])
    yaw = math.atan2(rotation[1, 0], rotation[0, 0])
    return np.concatenate([pose[:3, 3] + np.array(ROBOT_BASE), [roll, pitch, yaw]])


def _link(angle: float, offset: float, length: float, twist: float) -> NDArray[np.float64]:
    """Return the transform (4, 4) of a link."""
    cosine, sine, along, across = (
        math.cos(angle), math.sin(angle), math.cos(twist), math.sin(twist),
    )  # fmt: skip
    return np.array(
        [
            [cosine, -sine, 0.0, length],
            [sine * along, cosine * along, -across, -offset * across],
            [sine * across, cosine * across, along, offset * along],
            [0.0, 0.0, 0.0, 1.0],
        ]
    )
