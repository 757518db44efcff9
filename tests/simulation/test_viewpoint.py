"""Which triangles reach a pixel, compared with a renderer that tries every one; and the camera."""

import numpy as np
import pytest
import sapien

from roboirg.simulation.rendering.viewpoint import reach_pixels, to_front_camera


def covered(corners, shift):
    """Return for each triangle whether it covers a pixel's center near the middle of the picture.

    As renderers do it that round corners to 256 places in a pixel.

    Args:
        corners: (n, 3, 3), m: three points of each triangle, in front of the camera.
        shift: pixels by which corners are displaced.
    """
    places = 128 * corners[..., :2] / corners[..., 2:] + 128
    places = np.round((places + shift) * 256) / 256
    centers = np.arange(116, 140) + 0.5
    x, y = np.meshgrid(centers, centers)
    begin_x, begin_y = np.moveaxis(places, -1, 0)[..., None, None]
    end_x, end_y = np.moveaxis(np.roll(places, -1, axis=1), -1, 0)[..., None, None]
    areas = (end_x - begin_x) * (y - begin_y) - (end_y - begin_y) * (x - begin_x)
    inside = (areas <= 0).all(axis=1) | (areas >= 0).all(axis=1)
    return (inside & (areas.sum(axis=1) != 0)).any(axis=(1, 2))


def random_triangles(random):
    """Return 60 triangles (60, 3, 3), m, in the middle of the picture: specks and large ones."""
    size = 10.0 ** random.uniform(-2, 1, (60, 1, 1))
    middle = random.uniform(-12, 12, (60, 1, 2))
    pixels = np.clip(middle + size * random.standard_normal((60, 3, 2)), -12, 12)
    depth = 1 + random.uniform(0, 0.3, (60, 3, 1))
    return np.concatenate([pixels / 128 * depth, depth], axis=2)


def test_no_triangle_that_covers_a_pixel_is_left_out():
    """`reach_pixels` says which triangles may be left out, and is compared with `covered`, which
    tries every pixel, in 40 draws of 60 random triangles. A renderer rounds corners, so they are
    also shifted by up to a hundredth of a pixel."""
    random = np.random.default_rng(0)
    for _ in range(40):
        corners = random_triangles(random)
        shift = random.uniform(-0.01, 0.01, (60, 3, 2))

        shown = reach_pixels(corners)

        assert shown[covered(corners, 0.0)].all()
        assert shown[covered(corners, shift)].all()


def square_across_the_view(depth, half, center=(0.0, 0.0)):
    """Return two triangles (2, 3, 3), m: a square, `half` pixels from its center to its sides."""
    ends = np.array([(-1, -1), (1, -1), (1, 1), (-1, 1)], dtype=float) * half + center
    points = np.column_stack([ends / 128, np.ones(4)]) * depth
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
