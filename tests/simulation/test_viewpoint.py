"""Which triangles reach a pixel, compared with a renderer that tries every one; and the camera."""

import numpy as np
import pytest
import sapien
from hypothesis import given, settings
from hypothesis import strategies as st

from roboirg.core.observations import PICTURE_SIZE
from roboirg.simulation.rendering.viewpoint import (
    FOCAL_LENGTH,
    FRONT_EYE,
    FRONT_TARGET,
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
def random_triangles(draw):
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
@given(random_triangles(), st.integers(0, 99))
def test_no_triangle_that_covers_a_pixel_is_left_out(corners, seed):
    """Compares with a renderer that tries every triangle, with corners shifted by rounding."""
    shown = reach_pixels(corners)
    random = np.random.default_rng(seed)
    for size in (0.0, 0.01, 0.01, 0.01):
        assert shown[covered(corners, random.uniform(-size, size, (*corners.shape[:2], 2)))].all()


def square_across_the_view(depth, half, center=(0.0, 0.0)):
    """Two triangles across the view, `half` pixels from the center to the sides."""
    ends = np.array([(-1, -1), (1, -1), (1, 1), (-1, 1)], dtype=float) * half + center
    points = np.column_stack([ends / FOCAL_LENGTH, np.ones(4)]) * depth
    return points[[(0, 2, 1), (0, 3, 2)]]


def test_a_square_between_pixel_centers_is_left_out():
    """Half its width is 0.4 pixels, so it covers a
    center only where it is moved by half a pixel."""
    assert not reach_pixels(square_across_the_view(1.0, 0.4)).any()
    assert reach_pixels(square_across_the_view(1.0, 0.4, center=(0.5, 0.5))).all()
    assert reach_pixels(square_across_the_view(1.0, 0.49)).all(), (
        "it may be rounded to where it is shown"
    )


def test_a_square_outside_the_picture_is_left_out_and_one_behind_the_eye_is_kept():
    beside = square_across_the_view(1.0, 8, center=(PICTURE_SIZE, 0))
    behind = square_across_the_view(1.0, 8) * [1, 1, -1]
    assert reach_pixels(np.concatenate([beside, behind])).tolist() == [False] * 2 + [True] * 2


def test_the_front_camera_s_matrix_puts_its_target_straight_ahead():
    matrix = to_front_camera(sapien.Pose())
    far = np.linalg.norm(np.subtract(FRONT_TARGET, FRONT_EYE))

    assert matrix @ [*FRONT_TARGET, 1] == pytest.approx([0, 0, far, 1], abs=1e-6)
    # The camera looks back at the robot: the world's y is to its right, up is against its y.
    assert matrix[0, 1] == pytest.approx(1, abs=1e-6)
    assert matrix[1, 2] < 0
