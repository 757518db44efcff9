"""Which triangles reach a pixel, compared with a renderer that tries every one; and the camera."""

import numpy as np
import pytest
import sapien
from hypothesis import given, settings
from hypothesis import strategies as st

from roboirg.core.observations import PICTURE_SIZE
from roboirg.simulation.rendering.viewpoint import (
    FOCAL_LENGTH,
    reach_pixels,
    to_front_camera,
)

GRID = 256
"""Subpixel grid to which renderers round corners."""
WINDOW = 12
"""Half width of the tested area at the picture's center, pixels."""


def covered(corners, shift):
    """Return for each triangle whether it covers the center of a pixel of the window.

    `shift` displaces its corners, pixels.
    """
    places = FOCAL_LENGTH * corners[..., :2] / corners[..., 2:] + PICTURE_SIZE / 2
    places = np.round((places + shift) * GRID) / GRID
    ticks = np.arange(PICTURE_SIZE // 2 - WINDOW, PICTURE_SIZE // 2 + WINDOW) + 0.5
    x, y = np.meshgrid(ticks, ticks)
    (ax, ay), (bx, by) = (
        np.moveaxis(corner, -1, 0)[..., None, None]
        for corner in (places, np.roll(places, -1, axis=1))
    )
    areas = (bx - ax) * (y - ay) - (by - ay) * (x - ax)
    inside = (areas <= 0).all(axis=1) | (areas >= 0).all(axis=1)
    return (inside & (areas.sum(axis=1) != 0)).any(axis=(1, 2))


@st.composite
def triangles_in_the_window(draw):
    """Triangles (n, 3, 3) in the window, from specks to ones that fill it; some have no area."""
    random = np.random.default_rng(draw(st.integers(0, 2**32 - 1)))
    count = draw(st.integers(1, 60))
    size = 10.0 ** random.uniform(-2, 1, (count, 1, 1))
    middle = random.uniform(-WINDOW, WINDOW, (count, 1, 2))
    pixels = np.clip(middle + size * random.standard_normal((count, 3, 2)), -WINDOW, WINDOW)
    for corners in pixels:
        if random.random() < 0.2:
            corners[2] = corners[0] + random.choice([0.0, 0.5, 1.0]) * (corners[1] - corners[0])
    depths = 1 + random.uniform(0, 0.3, (count, 1)) + random.uniform(0, 0.02, (count, 3))
    return np.concatenate([pixels / FOCAL_LENGTH * depths[..., None], depths[..., None]], axis=2)


@settings(max_examples=40)
@given(triangles_in_the_window(), st.integers(0, 99))
def test_no_triangle_that_covers_a_pixel_is_left_out(corners, seed):
    """Compares with a renderer that tries every triangle, with corners shifted by rounding."""
    random = np.random.default_rng(seed)
    shift = random.uniform(-0.01, 0.01, (*corners.shape[:2], 2))

    shown = reach_pixels(corners)

    assert shown[covered(corners, 0.0)].all()
    assert shown[covered(corners, shift)].all()


def square_across_the_view(depth, half, center=(0.0, 0.0)):
    """Return two triangles (2, 3, 3), m: a square, `half` pixels from its center to its sides."""
    ends = np.array([(-1, -1), (1, -1), (1, 1), (-1, 1)], dtype=float) * half + center
    points = np.column_stack([ends / FOCAL_LENGTH, np.ones(4)]) * depth
    return points[[(0, 2, 1), (0, 3, 2)]]


@pytest.mark.parametrize(
    ("half", "center", "kept"),
    [
        (0.4, (0.0, 0.0), False),
        (0.4, (0.5, 0.5), True),
        (0.49, (0.0, 0.0), True),
        (8.0, (256.0, 0.0), False),
    ],
    ids=["between centers", "over a center", "within rounding of centers", "beside the picture"],
)
def test_a_square_is_kept_if_it_may_cover_the_center_of_a_pixel(half, center, kept):
    """In pixels from the middle of the picture, where four pixels meet: centers are 0.5 away."""
    square = square_across_the_view(1.0, half, center)

    assert reach_pixels(square).tolist() == [kept, kept]


def test_a_square_behind_the_eye_is_kept():
    """Its projection means nothing."""
    behind = square_across_the_view(1.0, 8.0) * [1, 1, -1]

    assert reach_pixels(behind).tolist() == [True, True]


def test_the_front_camera_s_matrix_puts_its_target_straight_ahead():
    """The camera is at (0.3, 0, 0.4) and looks at (0, 0, -0.2), 0.6708 m away."""
    matrix = to_front_camera(sapien.Pose())

    assert matrix @ [0.0, 0.0, -0.2, 1.0] == pytest.approx([0.0, 0.0, 0.6708, 1.0], abs=1e-4)


def test_the_front_camera_has_the_world_s_y_to_its_right_and_up_against_its_y():
    """It looks back at the robot."""
    matrix = to_front_camera(sapien.Pose())

    right = matrix[:3, :3] @ [0, 1, 0]
    up = matrix[:3, :3] @ [0, 0, 1]
    assert right == pytest.approx([1, 0, 0], abs=1e-6)
    assert up[1] < 0
