"""Field of view, the front camera's pose, and which triangles reach a pixel."""

from __future__ import annotations

import functools
import math
from typing import Any

import numpy as np
import sapien
from numpy.typing import NDArray

from roboirg.core.observations import PICTURE_SIZE

Array = NDArray[Any]
FIELD_OF_VIEW = math.pi / 2
FOCAL_LENGTH = PICTURE_SIZE / 2 / math.tan(FIELD_OF_VIEW / 2)
"""Pixels."""
NEAR = 0.01
FAR = 100.0
"""Near and far plane, m."""

PIXEL_CENTER = 0.5
"""From a pixel's upper or left edge to its center, pixels."""
EDGE_TOLERANCE = 1.0 / 32
"""Pixels by which a drawn edge may be displaced: ten times the effect of rounding corners to 1/256
of a pixel, as renderers with the usual 8 subpixel bits do."""

FRONT_EYE = (0.3, 0.0, 0.4)
FRONT_TARGET = (0.0, 0.0, -0.2)


def front_camera_pose() -> sapien.Pose:
    """Return the pose of the front camera in the world: x forward, y left, z up, as in SAPIEN."""
    forward = np.subtract(FRONT_TARGET, FRONT_EYE)
    forward /= np.linalg.norm(forward)
    left = np.cross([0.0, 0.0, 1.0], forward)
    left /= np.linalg.norm(left)
    matrix = np.eye(4)
    matrix[:3, :3] = np.stack([forward, left, np.cross(forward, left)], axis=1)
    matrix[:3, 3] = FRONT_EYE
    return sapien.Pose(matrix)


def transformed(points: Array, matrix: Array) -> Array:
    """Return points (..., 3) after a transform (4, 4), such as from a mesh's frame to a link's."""
    return points @ matrix[:3, :3].T + matrix[:3, 3]


def to_front_camera(pose: sapien.Pose) -> NDArray[np.float64]:
    """Return the transform (4, 4) from a frame to the front camera (OpenCV).

    Args:
        pose: of the frame in the world.
    """
    frame = front_camera_pose().inv() * pose
    # x right, y down, z forward of x forward, y left, z up
    axes = np.array([[0, -1, 0, 0], [0, 0, -1, 0], [1, 0, 0, 0], [0, 0, 0, 1]], dtype=np.float64)
    return np.asarray(axes @ frame.to_transformation_matrix(), dtype=np.float64)


@functools.cache
def front_camera_matrix() -> NDArray[np.float64]:
    """Return the transform (4, 4) from the world to the front camera (OpenCV)."""
    return to_front_camera(sapien.Pose())


def reach_pixels(corners: NDArray[np.float64]) -> NDArray[np.bool_]:
    """Return for each triangle whether its bounding box in the picture holds a pixel's center.

    All others are never drawn: of the robot's base, five of six in the front camera's view.

    Args:
        corners: of the triangles, (n, 3, 3), meters in the camera's frame: x right, y down, z
            forward (OpenCV).

    Returns:
        (n,); always true for triangles with a corner in front of the near plane, whose projection
        means nothing.
    """
    depths = corners[..., 2:]
    points = FOCAL_LENGTH * corners[..., :2] / depths + PICTURE_SIZE / 2  # pixels
    # The first and last pixels of the picture whose centers lie in the box, across and down.
    first = np.ceil(points.min(axis=1) - EDGE_TOLERANCE - PIXEL_CENTER).clip(min=0)
    last = np.floor(points.max(axis=1) + EDGE_TOLERANCE - PIXEL_CENTER).clip(max=PICTURE_SIZE - 1)
    has_pixel = (first <= last).all(axis=1)
    is_too_near = depths[..., 0].min(axis=1) < NEAR
    return np.asarray(has_pixel | is_too_near)
