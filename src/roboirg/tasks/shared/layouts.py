"""Patterns of three or four points about the origin, near which things are placed.

Figures: RoboMME.
"""

from __future__ import annotations

import math

import numpy as np

PlanePoint = tuple[float, float]
"""x and y in the world frame, meters."""

FOUR: tuple[PlanePoint, ...] = ((-0.05, -0.1), (-0.05, 0.1), (0.1, 0.1), (0.1, -0.1))
TRIANGLE: tuple[PlanePoint, ...] = ((-0.05, -0.1), (-0.05, 0.1), (0.1, 0.0))
LINE: tuple[PlanePoint, ...] = ((0.0, -0.15), (0.0, 0.15), (0.0, 0.0))

PATTERNS: dict[int, tuple[tuple[PlanePoint, ...], ...]] = {3: (TRIANGLE, LINE), 4: (FOUR,)}
"""By number of points; equally likely where there are several."""


def layout_points(rng: np.random.Generator, count: int) -> tuple[PlanePoint, ...]:
    """Three or four points, turned together about the origin by any angle of the full circle.

    Raises:
        KeyError: there is no pattern of so many points.
    """
    patterns = PATTERNS[count]
    pattern = patterns[int(rng.integers(len(patterns)))]
    angle = 2.0 * math.pi * rng.random()
    cos, sin = math.cos(angle), math.sin(angle)
    return tuple((cos * x - sin * y, sin * x + cos * y) for x, y in pattern)
