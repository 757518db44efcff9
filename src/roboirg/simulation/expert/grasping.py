"""Grasp selection of the scripted expert: fingers down, closing along one of the object's sides.

The side nearest to the current closing axis needs the shortest turn. If other objects block the
open fingers there, another side is better.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterable, Iterator, Mapping, Sequence

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from roboirg.core.footprints import Circle, Footprint, Rectangle, overlap
from roboirg.core.motions import Point
from roboirg.core.object_sizes import HALF_WIDTHS
from roboirg.simulation.bodies import Body

FINGER_OFFSET = 0.048
"""From the tool's axis to the middle of an open finger, m."""
FINGER_HALF = (0.008, 0.011)
"""Half sides of a fingertip, along the closing axis and across it, m."""
STEEPEST_SIDE = math.sqrt(0.5)
"""Vertical part of a unit vector that slopes by 45 degrees; with less it counts as horizontal."""

Direction = NDArray[np.float64]
"""A horizontal direction as a unit vector (2)."""


def grasp_rotations(name: str, bodies: Mapping[str, Body], tool: Rotation) -> list[Rotation]:
    """Return rotations of the tool for grasping an object, best first: four for a flat cube.

    Args:
        name: of the object.
        bodies: all objects, by name; the others are obstacles.
        tool: the tool's current rotation.
    """
    center = bodies[name].position
    closing_now = tool.as_matrix()[:2, 1]  # fingers close along the tool's y axis
    others = [body for other, body in bodies.items() if other != name]

    def cost(side: Direction) -> tuple[bool, float]:
        """Rank free sides before blocked ones, then those that need a shorter turn."""
        return _is_blocked(_fingers(center, side), others), -float(side @ closing_now)

    return [_rotation(side) for side in sorted(_sides(bodies[name]), key=cost)]


def _sides(body: Body) -> list[Direction]:
    """Return the directions in which an object's horizontal axes point, both ways.

    A cube that lies flat has four of them.
    """
    sides: list[Direction] = []
    for axis in body.entity.pose.to_transformation_matrix()[:3, :3].T:
        if abs(axis[2]) < STEEPEST_SIDE:
            along = axis[:2]
            length = np.linalg.norm(along)
            sides += [along / length, -along / length]
    return sides


def _is_blocked(fingers: Sequence[Rectangle], others: Iterable[Body]) -> bool:
    """Return whether one of the fingers would touch one of the other objects."""
    obstacles = itertools.chain.from_iterable(_footprints(body) for body in others)
    pairs = itertools.product(fingers, obstacles)
    return any(overlap(finger, obstacle) for finger, obstacle in pairs)


def _fingers(center: Point, side: Direction) -> list[Rectangle]:
    """Return the two areas of open fingers around a point that will close along a direction."""
    yaw = math.atan2(side[1], side[0])
    fingers = []
    for sign in (1.0, -1.0):
        x = center.x + sign * side[0] * FINGER_OFFSET
        y = center.y + sign * side[1] * FINGER_OFFSET
        fingers.append(Rectangle(x, y, *FINGER_HALF, yaw))
    return fingers


def _footprints(body: Body) -> Iterator[Footprint]:
    """Yield the area near the table that an object blocks; none for flat objects."""
    x, y, _ = body.position
    half = body.item.half_width
    if body.item.kind == "tape":
        yield Circle(x, y, half)
    elif body.item.kind in HALF_WIDTHS:
        yield Rectangle(x, y, half, half, body.yaw)


def _rotation(closing: Direction) -> Rotation:
    """Return the tool's rotation with the fingers down, closing along a direction.

    The columns of its matrix are the tool's axes: z is where the fingers point, y along which they
    close.
    """
    along = np.array([*closing, 0.0])
    approach = np.array([0.0, 0.0, -1.0])
    return Rotation.from_matrix(np.stack([np.cross(along, approach), along, approach], axis=1))
