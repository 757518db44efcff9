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
        """Return a world point in the rectangle's frame (m): from its center, x along its yaw."""
        cos = math.cos(self.yaw)
        sin = math.sin(self.yaw)
        dx = x - self.x
        dy = y - self.y
        # Turned back by the yaw.
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
        """Draw a uniform point (x, y) of the region, shrunk by `inset` meters on each side.

        Both random numbers are drawn at once, x first; the order decides which scene a seed gives.
        """
        share_x, share_y = rng.random(2).tolist()
        x = self.x + (2.0 * share_x - 1.0) * (self.half_x - inset)
        y = self.y + (2.0 * share_y - 1.0) * (self.half_y - inset)
        return x, y


def overlap(first: Footprint, second: Obstacle) -> bool:
    """Return whether a footprint on the table touches or overlaps an obstacle.

    There is a case for each pair of shapes; the order of the cases does not matter but for the
    last, which exchanges the two. As in RoboMME, a line next to a rectangle counts as clear of it
    only if their projections on a side of the rectangle or on the line are apart: not those across
    the line.
    """
    if isinstance(second, Line):
        return _overlaps_line(first, second)
    if isinstance(first, Rectangle) and isinstance(second, Rectangle):
        return not any(_separations(first, second)) and not any(_separations(second, first))
    if isinstance(first, Circle) and isinstance(second, Circle):
        distance = math.hypot(first.x - second.x, first.y - second.y)
        return distance <= first.radius + second.radius
    if isinstance(first, Circle) and isinstance(second, Rectangle):
        return distance_to(second, first.x, first.y) <= first.radius
    return overlap(second, first)  # a rectangle and a circle, the other way round


def _overlaps_line(footprint: Footprint, line: Line) -> bool:
    """Return whether a footprint touches or overlaps a line; see `overlap`."""
    thin = Rectangle(line.x, line.y, line.half, 0.0, line.yaw)
    if isinstance(footprint, Circle):
        return overlap(footprint, thin)
    # The second axis of the line, across it, is the one that does not count.
    are_apart_along_line, _ = _separations(thin, footprint)
    return not are_apart_along_line and not any(_separations(footprint, thin))


def distance_to(rectangle: Rectangle, x: float, y: float) -> float:
    """Return the Euclidean distance from a point to a rectangle, meters; 0 inside."""
    local_x, local_y = rectangle.to_local(x, y)
    beyond_x = max(abs(local_x) - rectangle.half_x, 0.0)
    beyond_y = max(abs(local_y) - rectangle.half_y, 0.0)
    return math.hypot(beyond_x, beyond_y)


def _separations(first: Rectangle, second: Rectangle) -> tuple[bool, bool]:
    """Return whether the x axis, and whether the y axis, of `first` separates two rectangles.

    An axis separates them if their projections (shadows) on it do not touch. Two rectangles are
    apart if one of the four axes of both separates them (separating-axis test): call it both ways
    round.
    """
    center_x, center_y = first.to_local(second.x, second.y)
    cos = abs(math.cos(second.yaw - first.yaw))
    sin = abs(math.sin(second.yaw - first.yaw))
    # How far the second reaches from its center along the axes of the first.
    reach_x = cos * second.half_x + sin * second.half_y
    reach_y = sin * second.half_x + cos * second.half_y
    are_apart_in_x = abs(center_x) > first.half_x + reach_x
    are_apart_in_y = abs(center_y) > first.half_y + reach_y
    return are_apart_in_x, are_apart_in_y


def place(
    draw: Callable[[], Placement],
    clearance: Callable[[Placement], Footprint],
    obstacles: Sequence[Obstacle],
) -> Placement | None:
    """Return the first of at most 256 draws whose clearance is free of all obstacles.

    Args:
        draw: returns a random candidate.
        clearance: returns the area that a candidate needs.
        obstacles: what the area must not touch.

    Returns:
        The candidate; None if every draw hits an obstacle.
    """
    for _ in range(MAX_DRAWS):
        candidate = draw()
        area = clearance(candidate)
        if not any(overlap(area, obstacle) for obstacle in obstacles):
            return candidate
    return None
