"""Occlusion culling, compared with a renderer that tries every triangle and pixel."""

import numpy as np
import pytest
import sapien
from hypothesis import given, settings
from hypothesis import strategies as st

from roboirg.simulation.rendering.occlusion import unoccluded_triangles
from roboirg.simulation.rendering.viewpoint import (
    FOCAL_LENGTH,
    FRONT_EYE,
    FRONT_TARGET,
    SIZE,
    to_front_camera,
)

GRID = 256
"""Subpixel grid to which renderers round corners."""
WINDOW = 12
"""Half width of the tested area at the picture's center, pixels."""


DEPTH_NOISE = 1e-5
"""Meters."""


def painted(corners, shift, noise, *, both_sides):
    """Return the triangle that a renderer would show at each pixel of the window; -1 for none.

    `shift` displaces each triangle's corners (pixels) and `noise` its depth (m).
    """
    places = FOCAL_LENGTH * corners[..., :2] / corners[..., 2:] + SIZE / 2
    places = np.round((places + shift) * GRID) / GRID
    ticks = np.arange(SIZE // 2 - WINDOW, SIZE // 2 + WINDOW) + 0.5
    x, y = np.meshgrid(ticks, ticks)
    nearest, winner = np.full(x.shape, np.inf), np.full(x.shape, -1)
    for number, (place, depths) in enumerate(zip(places, corners[..., 2], strict=True)):
        areas = []
        for k in range(3):
            (ax, ay), (bx, by) = place[k], place[(k + 1) % 3]
            areas.append((bx - ax) * (y - ay) - (by - ay) * (x - ax))
        areas = np.stack(areas)
        total = areas.sum(axis=0)
        inside = (areas <= 0).all(axis=0)
        if both_sides:
            inside |= (areas >= 0).all(axis=0)
        inside &= total != 0
        weights = areas / np.where(total == 0, 1, total)
        with np.errstate(divide="ignore"):  # where there is nothing to divide
            depth = 1 / np.einsum("kij,k->ij", weights[[1, 2, 0]], 1 / depths) + noise[number]
        ahead = inside & (depth < nearest)
        nearest[ahead], winner[ahead] = depth[ahead], number
    return winner


@st.composite
def soups(draw):
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
@given(soups(), st.booleans(), st.integers(0, 99))
def test_whatever_a_renderer_shows_is_kept(corners, both_sides, seed):
    shown = unoccluded_triangles(corners)
    random = np.random.default_rng(seed)
    for size in (0.0, 1.0, 1.0, 1.0):
        shift = size * random.uniform(-0.01, 0.01, (*corners.shape[:2], 2))
        noise = size * random.uniform(-DEPTH_NOISE, DEPTH_NOISE, len(corners))
        winner = painted(corners, shift, noise, both_sides=both_sides)
        assert shown[winner[winner >= 0]].all()


def square(depth, half, center=(0.0, 0.0), *, back=False):
    """Two triangles across the view, `half` pixels from the center to the sides."""
    ends = np.array([(-1, -1), (1, -1), (1, 1), (-1, 1)], dtype=float) * half + center
    points = np.column_stack([ends / FOCAL_LENGTH, np.ones(4)]) * depth
    order = [(0, 1, 2), (0, 2, 3)] if back else [(0, 2, 1), (0, 3, 2)]
    return points[order]


def test_what_is_behind_something_else_is_left_out():
    wide, hidden = square(1.0, 8), square(1.01, 1.5, center=(4, -4))
    peeping, nearer = square(1.01, 9), square(0.99, 2)
    corners = np.concatenate([wide, hidden, peeping, nearer])
    assert unoccluded_triangles(corners).tolist() == [True] * 2 + [False] * 2 + [True] * 4


def test_what_is_nearly_as_near_is_kept():
    behind = square(1.0003, 1.5, center=(4, -4))
    assert unoccluded_triangles(np.concatenate([square(1.0, 8), behind])).all()


def test_what_turns_its_back_hides_nothing():
    behind = square(1.1, 1.5, center=(4, -4))
    assert unoccluded_triangles(np.concatenate([square(1.0, 8, back=True), behind])).all()


def test_what_lies_between_the_middles_of_pixels_is_left_out():
    assert not unoccluded_triangles(square(1.0, 0.4)).any()
    assert unoccluded_triangles(square(1.0, 0.4, center=(0.5, 0.5))).all()
    assert unoccluded_triangles(square(1.0, 0.49)).all(), "it may be rounded to where it is shown"


def test_what_is_out_of_the_picture_is_left_out_and_what_is_at_the_eye_is_kept():
    beside = square(1.0, 8, center=(SIZE, 0))
    behind = square(1.0, 8) * [1, 1, -1]
    assert (
        unoccluded_triangles(np.concatenate([beside, behind])).tolist() == [False] * 2 + [True] * 2
    )


def test_the_front_camera_s_frame():
    matrix = to_front_camera(sapien.Pose())
    far = np.linalg.norm(np.subtract(FRONT_TARGET, FRONT_EYE))
    assert matrix @ [*FRONT_TARGET, 1] == pytest.approx([0, 0, far, 1], abs=1e-6)
    # The camera looks back at the robot: the world's y is to its right, up is against its y.
    assert matrix[0, 1] == pytest.approx(1, abs=1e-6)
    assert matrix[1, 2] < 0
