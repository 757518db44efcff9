"""Clearance tests are exact: compared with dense sampling of the shapes."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from roboirg.core.episode import Point, SceneObject
from roboirg.core.footprints import (
    MAX_DRAWS,
    Circle,
    Line,
    Rectangle,
    distance_to,
    overlap,
    place,
)
from roboirg.tasks.shared.fixtures import cube_obstacle, footprint

meters_from_the_middle = st.floats(-0.3, 0.3)
sizes = st.floats(0.01, 0.15)
angles = st.floats(-math.pi, math.pi)
rectangles = st.builds(
    Rectangle, meters_from_the_middle, meters_from_the_middle, sizes, sizes, angles
)
circles = st.builds(Circle, meters_from_the_middle, meters_from_the_middle, sizes)
footprints = st.one_of(rectangles, circles)


GRID = np.arange(-0.6, 0.6, 0.01)
GRID_X, GRID_Y = np.meshgrid(GRID, GRID)
"""Points all over the table, 1 cm apart."""


def grid_points_in(shape, grown_by=0.0):
    """Return for each point of the grid whether it lies in a shape, which may be grown, m."""
    right = GRID_X - shape.x
    ahead = GRID_Y - shape.y
    if isinstance(shape, Circle):
        return np.hypot(right, ahead) <= shape.radius + grown_by
    cos = math.cos(shape.yaw)
    sin = math.sin(shape.yaw)
    is_within_x = abs(cos * right + sin * ahead) <= shape.half_x + grown_by
    is_within_y = abs(cos * ahead - sin * right) <= shape.half_y + grown_by
    return is_within_x & is_within_y


@settings(max_examples=60)
@given(footprints, footprints)
def test_shapes_that_share_points_overlap(first, second):
    """The shapes, circles and turned rectangles, are compared at points 1 cm apart all over the
    table: if any point lies in both, they overlap."""
    if (grid_points_in(first) & grid_points_in(second)).any():
        assert overlap(first, second)


@settings(max_examples=60)
@given(footprints, footprints)
def test_shapes_far_from_sharing_points_do_not_overlap(first, second):
    """A point of the grid less than 1 cm from a common one would lie in both grown shapes."""
    if not (grid_points_in(first, 0.01) & grid_points_in(second, 0.01)).any():
        assert not overlap(first, second)


@settings(max_examples=40)
@given(footprints, footprints)
def test_overlap_is_symmetric(first, second):
    """Circles and rectangles of any size and turn, in either order."""
    assert overlap(first, second) == overlap(second, first)


@settings(max_examples=40)
@given(rectangles, st.floats(0.001, 0.05), meters_from_the_middle, meters_from_the_middle)
def test_growing_a_rectangle_brings_its_edge_nearer_by_that_much(rectangle, by, x, y):
    """At a corner the distance falls by up to the diagonal, √2 times as much."""
    before = distance_to(rectangle, x, y)
    after = distance_to(rectangle.grown(by), x, y)

    assert after <= before
    assert before - after <= by * math.sqrt(2) + 1e-9


@pytest.mark.parametrize(
    ("shape", "expected"),
    [
        (Circle(2, 0, 1), True),
        (Circle(2.001, 0, 1), False),
        (Rectangle(2, 0, 1, 1), True),
        (Rectangle(2.001, 0, 1, 1), False),
    ],
)
def test_touching_a_circle_counts_as_overlap(shape, expected):
    """Rectangles are (x, y, half width, half depth), circles (x, y, radius)."""
    assert overlap(Circle(0, 0, 1), shape) is expected


@pytest.mark.parametrize(
    ("shape", "expected"),
    [
        (Circle(0, 0.5, 0.5), True),
        (Circle(0, 0.501, 0.5), False),
        (Circle(1.5, 0, 0.5), True),
        (Circle(1.501, 0, 0.5), False),
        (Rectangle(2, 0, 1, 1), True),
        (Rectangle(2.001, 0, 1, 1), False),
        (Rectangle(0, 1.001, 1, 1), False),
    ],
)
def test_touching_a_line_without_breadth_counts_as_overlap(shape, expected):
    """The line runs from (-1, 0) to (1, 0)."""
    assert overlap(shape, Line(0, 0, 1, 0)) is expected


def test_a_turned_square_next_to_a_line_is_reported_as_overlapping_it():
    """Its nearest corner is 0.1 away, but its sides' projections meet those of the line.
    RoboMME tests it in this way, so we do; a rectangle without breadth is tested exactly."""
    beside = Rectangle(0, 0.1 + math.sqrt(2), 1, 1, math.pi / 4)

    assert not overlap(beside, Rectangle(0, 0, 1, 0))
    assert overlap(beside, Line(0, 0, 1, 0))


cubes = st.builds(
    lambda x, y, yaw: SceneObject("cube", "cube", Point(x, y, 0.02), yaw),
    st.floats(-0.08, 0.08),
    st.floats(-0.08, 0.08),
    st.floats(0, 2 * math.pi),
)


@settings(max_examples=40)
@given(cubes, cubes)
def test_cubes_never_overlap_although_some_count_as_lines(first, second):
    """Half of the cubes keep others away like a line only, as in RoboMME."""
    if not overlap(footprint(second).grown(0.02), cube_obstacle(first)):
        assert not overlap(footprint(second).grown(-1e-9), footprint(first))


@pytest.mark.parametrize(
    ("yaw", "shape", "turn"),
    [
        (2.0000005, Rectangle, 0.0),
        (2.0000015, Rectangle, 0.0),
        (2.0000025, Line, 0.0),
        (2.0000035, Line, math.pi / 2),
    ],
    ids=["square", "another square", "line along the yaw", "line across the yaw"],
)
def test_half_of_the_cubes_keep_others_away_like_a_line_in_either_direction(yaw, shape, turn):
    """RoboMME mistakes half of all cubes for lines, as its rounding falls. Here the yaw of a cube,
    rad, decides in whole millionths: of four in a row two are squares and two are lines, one along
    the cube's own axis and one a quarter turn from it."""
    cube = SceneObject("cube", "cube", Point(0, 0, 0.02), yaw)

    obstacle = cube_obstacle(cube)

    assert type(obstacle) is shape
    assert obstacle.yaw == pytest.approx(yaw + turn, abs=1e-9)


def unit_circle_at(x):
    return Circle(x, 0, 1)


@pytest.mark.parametrize("rejected", [0, 5, MAX_DRAWS - 1])
def test_place_returns_the_first_draw_that_does_not_overlap(rejected):
    """Draws are x coordinates; 0 is taken."""
    draws = iter([*[0.0] * rejected, 9.0, 8.0])

    assert place(lambda: next(draws), unit_circle_at, [unit_circle_at(0)]) == 9.0


def test_place_gives_up_after_the_maximum_number_of_draws():
    draws = iter([*[0.0] * MAX_DRAWS, 9.0])

    assert place(lambda: next(draws), unit_circle_at, [unit_circle_at(0)]) is None
    assert next(draws) == 9.0
