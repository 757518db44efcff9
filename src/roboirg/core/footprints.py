"""Place objects by rejection sampling, with exact clearance tests in the plane.

Shapes are footprints on the table: rectangles for cubes, containers and buttons, circles for
target discs. The first of at most 256 uniform draws with enough clearance is accepted, as in
RoboMME, where every other cube stands in the way as a mere line.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import NamedTuple, TypeVar

import numpy as np

MAX_DRAWS = 256

Placement = TypeVar("Placement")


@dataclass(frozen=True, slots=True)
class Rectangle:
    """A footprint: center (m), half sides (m) and yaw (rad)."""

    x: float
    y: float
    half_x: float
    half_y: float
    yaw: float = 0.0

    def grown(self, by: float) -> Rectangle:
        """Return the rectangle with every side moved outwards by `by` meters."""
        return Rectangle(self.x, self.y, self.half_x + by, self.half_y + by, self.yaw)

    def to_local(self, x: float, y: float) -> tuple[float, float]:
        """Return a world point in the rectangle's frame."""
        cos, sin = math.cos(self.yaw), math.sin(self.yaw)
        dx, dy = x - self.x, y - self.y
        return cos * dx + sin * dy, cos * dy - sin * dx


@dataclass(frozen=True, slots=True)
class Circle:
    """A round footprint: center and radius, meters."""

    x: float
    y: float
    radius: float


@dataclass(frozen=True, slots=True)
class Line:
    """A straight line: middle, half length (m) and direction (rad)."""

    x: float
    y: float
    half: float
    yaw: float


Footprint = Rectangle | Circle
Obstacle = Footprint | Line


class Region(NamedTuple):
    """A rectangle of the table in which centers are drawn: center and half extents, meters."""

    x: float
    y: float
    half_x: float
    half_y: float

    def draw(self, rng: np.random.Generator, inset: float = 0.0) -> tuple[float, float]:
        """Draw a uniform point of the region, shrunk by `inset` on each side."""
        u, v = rng.random(2).tolist()
        return (
            self.x + (2.0 * u - 1.0) * (self.half_x - inset),
            self.y + (2.0 * v - 1.0) * (self.half_y - inset),
        )


def overlap(first: Footprint, second: Obstacle) -> bool:
    """Return whether a footprint touches or overlaps an obstacle.

    As in RoboMME, a line next to a rectangle counts as clear of it only if their projections on a
    side of the rectangle or on the line are apart: not those across the line.
    """
    if isinstance(second, Line):
        thin = Rectangle(second.x, second.y, second.half, 0.0, second.yaw)
        if isinstance(first, Circle):
            return overlap(first, thin)
        return not (any(_separations(first, thin)) or _separations(thin, first)[0])
    if isinstance(first, Rectangle) and isinstance(second, Rectangle):
        return not any((*_separations(first, second), *_separations(second, first)))
    if isinstance(first, Circle) and isinstance(second, Circle):
        return math.hypot(first.x - second.x, first.y - second.y) <= first.radius + second.radius
    if isinstance(first, Circle) and isinstance(second, Rectangle):
        return distance_to(second, first.x, first.y) <= first.radius
    return overlap(second, first)


def distance_to(rectangle: Rectangle, x: float, y: float) -> float:
    """Return the Euclidean distance from a point to a rectangle, meters; 0 inside."""
    local_x, local_y = rectangle.to_local(x, y)
    return math.hypot(
        max(abs(local_x) - rectangle.half_x, 0.0), max(abs(local_y) - rectangle.half_y, 0.0)
    )


def _separations(first: Rectangle, second: Rectangle) -> tuple[bool, bool]:
    """Return for either axis of `first` whether it separates the two (separating-axis test)."""
    center_x, center_y = first.to_local(second.x, second.y)
    cos, sin = abs(math.cos(second.yaw - first.yaw)), abs(math.sin(second.yaw - first.yaw))
    reach_x = cos * second.half_x + sin * second.half_y
    reach_y = sin * second.half_x + cos * second.half_y
    return abs(center_x) > first.half_x + reach_x, abs(center_y) > first.half_y + reach_y


def place(
    draw: Callable[[], Placement],
    clearance: Callable[[Placement], Footprint],
    obstacles: Sequence[Obstacle],
) -> Placement | None:
    """Return the first of at most 256 draws whose clearance is free of all obstacles.

    The clearance is the area that a candidate needs. None if every draw hits an obstacle.
    """
    for _ in range(MAX_DRAWS):
        candidate = draw()
        area = clearance(candidate)
        if not any(overlap(area, obstacle) for obstacle in obstacles):
            return candidate
    return None
