"""Occlusion culling of a fixed body for a fixed camera.

The front camera shows the robot's base in some 700 pixels, while its mesh has 20,000 triangles.
Most of them lie behind others or between pixel centers, where they are never drawn. This module
finds them, with tolerances for the rounding of renderers.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from roboirg.simulation.rendering.viewpoint import FOCAL_LENGTH, NEAR, SIZE

Floats = NDArray[np.float64]

EDGE_TOLERANCE = 1.0 / 32
"""Pixels by which a drawn edge may be displaced: ten times the effect of rounding corners to 1/256
of a pixel, as renderers with the usual 8 subpixel bits do."""
DEPTH_TOLERANCE = 5e-4
"""Meters by which a farther surface may be drawn in front of a nearer one: eighty times the step,
at one meter, of a single-precision depth buffer from 1 cm to 100 m."""


class _Fragments(NamedTuple):
    """Possible fragments: one row for each triangle and pixel center.

    Attributes:
        triangle: index of the triangle.
        pixel: index of the pixel.
        certain: whether the triangle is drawn there if nothing is in front of it.
        nearest: smallest possible depth there, m.
        farthest: largest possible depth there, m.
    """

    triangle: NDArray[np.intp]
    pixel: NDArray[np.intp]
    certain: NDArray[np.bool_]
    nearest: Floats
    farthest: Floats


def unoccluded_triangles(corners: Floats) -> NDArray[np.bool_]:
    """Return for each opaque triangle of a body whether any pixel can show it.

    The renderer may or may not draw triangles that face away from the camera, so these are never
    assumed to occlude others.

    Args:
        corners: corners of the triangles, (n, 3, 3), meters in the camera's frame: x right, y down,
            z forward (OpenCV).

    Returns:
        (n); always true for triangles with a corner in front of the near plane.
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
    """Return the possible fragments of triangles (n, 3, 3) in front of the camera."""
    places = FOCAL_LENGTH * corners[..., :2] / corners[..., 2:] + SIZE / 2
    triangle, center = _candidates(places)
    inverse = 1.0 / corners[triangle, :, 2]  # inverse depth is linear in the picture
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
    """Return triangle indices and the pixel centers in their bounding boxes."""
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
    """Return distances of points (n, 2) inside triangles' edges (n, 3, 2), pixels, and twice areas.

    The area of a triangle that faces the camera is negative: its corners are counterclockwise as
    seen from the camera, and y is down.
    """
    edges = np.roll(places, -1, axis=1) - places
    area = _cross(edges[:, 0], edges[:, 1])
    distances = _cross(edges, points[:, None] - places)
    with np.errstate(invalid="ignore", divide="ignore"):  # edges of zero length
        distances /= np.linalg.norm(edges, axis=-1)
    return np.nanmin(np.sign(area)[:, None] * distances, axis=1, initial=np.inf), area


def _range_near(places: Floats, values: Floats, points: Floats) -> tuple[Floats, Floats]:
    """Return the range near points (n, 2) of a quantity that is linear on triangles.

    Args:
        places: corners of the triangles (n, 3, 2), pixels.
        values: values at the corners (n, 3), which bound the result.
        points: one point in each triangle's plane (n, 2), pixels.
    """
    edges, rise = places[:, 1:] - places[:, :1], values[:, 1:] - values[:, :1]
    with np.errstate(invalid="ignore", divide="ignore"):  # triangles of zero area
        area = _cross(edges[:, 0], edges[:, 1])
        slope_x = (rise[:, 0] * edges[:, 1, 1] - rise[:, 1] * edges[:, 0, 1]) / area
        slope_y = (rise[:, 1] * edges[:, 0, 0] - rise[:, 0] * edges[:, 1, 0]) / area
        x, y = (points - places[:, 0]).T
        value = values[:, 0] + slope_x * x + slope_y * y
        change = (np.abs(slope_x) + np.abs(slope_y)) * EDGE_TOLERANCE
        # These ignore NaN.
        least = np.fmax(value - change, values.min(axis=1))
        greatest = np.fmin(value + change, values.max(axis=1))
    return least, greatest


def _cross(first: Floats, second: Floats) -> Floats:
    """Return the cross product of vectors (..., 2)."""
    return np.asarray(first[..., 0] * second[..., 1] - first[..., 1] * second[..., 0])
