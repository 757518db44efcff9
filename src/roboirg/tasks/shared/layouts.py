"""Patterns of three or four points around the origin, near which objects are placed.

Figures: RoboMME.
"""

from __future__ import annotations

import math

import numpy as np

from roboirg.util.random_draws import draw

PlanePoint = tuple[float, float]
"""x and y in the world frame, meters."""

FOUR: tuple[PlanePoint, ...] = ((-0.05, -0.1), (-0.05, 0.1), (0.1, 0.1), (0.1, -0.1))
TRIANGLE: tuple[PlanePoint, ...] = ((-0.05, -0.1), (-0.05, 0.1), (0.1, 0.0))
LINE: tuple[PlanePoint, ...] = ((0.0, -0.15), (0.0, 0.15), (0.0, 0.0))

PATTERNS: dict[int, tuple[tuple[PlanePoint, ...], ...]] = {3: (TRIANGLE, LINE), 4: (FOUR,)}
"""Patterns by number of points; those of three are equally likely."""


def layout_points(rng: np.random.Generator, count: int) -> tuple[PlanePoint, ...]:
    """Draw a pattern of three or four points, turned about the origin by any angle.

    Returns `count` points (x, y) in meters. Their order is that of the pattern; it decides which
    object stands where.
    """
    pattern = draw(rng, PATTERNS[count])
    angle = 2.0 * math.pi * rng.random()
    cos = math.cos(angle)
    sin = math.sin(angle)
    points = []
    for x, y in pattern:
        turned_x = cos * x - sin * y
        turned_y = sin * x + cos * y
        points.append((turned_x, turned_y))
    return tuple(points)
