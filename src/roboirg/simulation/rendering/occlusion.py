"""Occlusion culling of a body that never moves for a camera that never moves.

The front camera sees the robot's base with some 700 pixels, and the base's mesh has 20,000
triangles. Most of them lie behind others or between the centers of pixels, where they are never
drawn. Which do is found here, with tolerances for the roundings of whatever draws them.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from roboirg.simulation.rendering.viewpoint import FOCAL_LENGTH, NEAR, SIZE

Floats = NDArray[np.float64]

EDGE_TOLERANCE = 1.0 / 32
"""Pixels by which an edge may be drawn elsewhere: ten times what it may move where corners are
rounded to 1/256 of a pixel, as they are by renderers with the usual 8 subpixel bits."""
DEPTH_TOLERANCE = 5e-4
"""Meters by which something may be drawn in front of what is nearer: eighty times the step of a
depth buffer of single precision, from 1 cm to 100 m, at a meter."""


class _Fragments(NamedTuple):
    """Where triangles may be drawn: one row for each triangle and pixel center.

    Attributes:
        triangle: its number.
        pixel: its number.
        certain: whether the triangle is drawn there if nothing is in front of it.
        nearest: the least depth that it may have there, m.
        farthest: the greatest.
    """

    triangle: NDArray[np.intp]
    pixel: NDArray[np.intp]
    certain: NDArray[np.bool_]
    nearest: Floats
    farthest: Floats


def shown_triangles(corners: Floats) -> NDArray[np.bool_]:
    """For each opaque triangle whether a pixel can show it when nothing else is in the way.

    Triangles that face away from the camera may or may not be drawn by the renderer; none of them
    is taken to hide another.

    Args:
        corners: of the triangles, (n, 3, 3), meters in the camera's frame: x right, y down,
            z forward (OpenCV).

    Returns:
        (n); true for all triangles with a corner nearer than the near plane.
    """
    cut: NDArray[np.bool_] = corners[..., 2].min(axis=1) < NEAR
    numbers = np.flatnonzero(~cut)
    fragments = _fragments(corners[numbers])
    occluded_from = np.full(SIZE * SIZE, np.inf)
    certain = fragments.certain
    np.minimum.at(occluded_from, fragments.pixel[certain], fragments.farthest[certain])
    seen = fragments.nearest <= occluded_from[fragments.pixel] + DEPTH_TOLERANCE
    shown = cut.copy()
    shown[numbers[fragments.triangle[seen]]] = True
    return shown


def _fragments(corners: Floats) -> _Fragments:
    """Of triangles (n, 3, 3) in front of the camera."""
    places = FOCAL_LENGTH * corners[..., :2] / corners[..., 2:] + SIZE / 2
    triangle, center = _candidates(places)
    inverse = 1.0 / corners[triangle, :, 2]  # depth, which is linear in a picture
    distance, area = _edge_distance(places[triangle], center)
    least, greatest = _range_near(places[triangle], inverse, center)
    column, row = center.astype(np.intp).T
    found = _Fragments(
        triangle,
        row * SIZE + column,
        (distance > EDGE_TOLERANCE) & (area < 0),
        1.0 / greatest,
        1.0 / least,
    )
    possible = ~(distance < -EDGE_TOLERANCE)
    return _Fragments._make(field[possible] for field in found)


def _candidates(places: Floats) -> tuple[NDArray[np.intp], Floats]:
    """Triangles and the pixel centers in the boxes around them."""
    low = np.ceil(places.min(axis=1) - EDGE_TOLERANCE - 0.5)
    high = np.floor(places.max(axis=1) + EDGE_TOLERANCE - 0.5)
    low = np.clip(low, 0, SIZE).astype(np.intp)
    high = np.clip(high, -1, SIZE - 1).astype(np.intp)
    width, height = np.maximum(high - low + 1, 0).T
    count = width * height
    triangle = np.repeat(np.arange(len(places)), count)
    place = np.arange(count.sum()) - np.repeat(np.cumsum(count) - count, count)
    row, column = np.divmod(place, width[triangle])
    return triangle, low[triangle] + np.stack([column, row], axis=1) + 0.5


def _edge_distance(places: Floats, points: Floats) -> tuple[Floats, Floats]:
    """How far points (n, 2) are inside the edges of triangles (n, 3, 2), pixels; twice their areas.

    The area of a triangle that faces the camera is negative: its corners come counterclockwise for
    the one who looks, and y is down.
    """
    edges = np.roll(places, -1, axis=1) - places
    area = _cross(edges[:, 0], edges[:, 1])
    distances = _cross(edges, points[:, None] - places)
    with np.errstate(invalid="ignore", divide="ignore"):  # of edges without a length
        distances /= np.linalg.norm(edges, axis=-1)
    return np.nanmin(np.sign(area)[:, None] * distances, axis=1, initial=np.inf), area


def _range_near(places: Floats, values: Floats, points: Floats) -> tuple[Floats, Floats]:
    """The least and the greatest value near points (n, 2) of what is linear on triangles.

    Args:
        places: of the triangles' corners (n, 3, 2), pixels.
        values: at the corners (n, 3), which none exceeds.
        points: of each triangle's plane, pixels.
    """
    edges, rise = places[:, 1:] - places[:, :1], values[:, 1:] - values[:, :1]
    with np.errstate(invalid="ignore", divide="ignore"):  # of triangles without an area
        area = _cross(edges[:, 0], edges[:, 1])
        slope_x = (rise[:, 0] * edges[:, 1, 1] - rise[:, 1] * edges[:, 0, 1]) / area
        slope_y = (rise[:, 1] * edges[:, 0, 0] - rise[:, 0] * edges[:, 1, 0]) / area
        x, y = (points - places[:, 0]).T
        value = values[:, 0] + slope_x * x + slope_y * y
        change = (np.abs(slope_x) + np.abs(slope_y)) * EDGE_TOLERANCE
        # Of a number and NaN these give the number.
        least = np.fmax(value - change, values.min(axis=1))
        greatest = np.fmin(value + change, values.max(axis=1))
    return least, greatest


def _cross(first: Floats, second: Floats) -> Floats:
    """Of vectors (..., 2)."""
    return np.asarray(first[..., 0] * second[..., 1] - first[..., 1] * second[..., 0])
