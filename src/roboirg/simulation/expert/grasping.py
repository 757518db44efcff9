"""Grasp selection of the scripted expert: fingers down, closing along one of the object's sides.

The side nearest to the current closing axis needs the shortest turn. If other objects block the
open fingers there, another side is better.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterator, Mapping

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from roboirg.core.footprints import Circle, Footprint, Rectangle, overlap
from roboirg.core.object_sizes import HALF_WIDTHS
from roboirg.simulation.bodies import Body

FINGER_OFFSET = 0.048
"""From the tool's axis to the middle of an open finger, m."""
FINGER_HALF = (0.008, 0.011)
"""Half sides of a fingertip, along the closing axis and across it, m."""


def grasp_rotations(name: str, bodies: Mapping[str, Body], tool: Rotation) -> list[Rotation]:
    """Return rotations of the tool for grasping an object, best first, given the current one."""
    matrix = bodies[name].entity.pose.to_transformation_matrix()[:3, :3]
    flat = [axis[:2] for axis in matrix.T if abs(axis[2]) < math.sqrt(0.5)]
    sides = [
        sign * axis / np.linalg.norm(axis) for axis, sign in itertools.product(flat, (1.0, -1.0))
    ]
    closing_now = tool.as_matrix()[:2, 1]
    obstacles = [
        area for other, body in bodies.items() if other != name for area in _footprints(body)
    ]
    x, y, _ = bodies[name].position

    def cost(side: NDArray[np.float64]) -> tuple[bool, float]:
        fingers = _fingers(x, y, side)
        blocked = any(overlap(*pair) for pair in itertools.product(fingers, obstacles))
        return blocked, -float(side @ closing_now)

    return [_rotation(side) for side in sorted(sides, key=cost)]


def _fingers(x: float, y: float, side: NDArray[np.float64]) -> list[Rectangle]:
    yaw = math.atan2(side[1], side[0])
    return [
        Rectangle(
            x + sign * side[0] * FINGER_OFFSET,
            y + sign * side[1] * FINGER_OFFSET,
            *FINGER_HALF,
            yaw,
        )
        for sign in (1.0, -1.0)
    ]


def _footprints(body: Body) -> Iterator[Footprint]:
    """Yield the areas near the table that an object blocks."""
    x, y, _ = body.position
    half = body.item.half_width
    if body.item.kind == "tape":
        yield Circle(x, y, half)
    elif body.item.kind in HALF_WIDTHS:
        yield Rectangle(x, y, half, half, body.yaw)


def _rotation(closing: NDArray[np.float64]) -> Rotation:
    """Return the rotation with fingers down, closing along a horizontal direction (2)."""
    along = np.array([*closing, 0.0])
    approach = np.array([0.0, 0.0, -1.0])
    return Rotation.from_matrix(np.stack([np.cross(along, approach), along, approach], axis=1))
