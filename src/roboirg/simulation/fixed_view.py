"""What a camera that never moves can see of a body that never moves.

The front camera sees the robot's base with some 700 pixels, and the base's mesh has 20,000
triangles. Most of them lie behind others or between the middles of pixels, where they are never
drawn. Which do is found here, with room for the roundings of whatever draws them.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from roboirg.simulation.viewpoint import FOCAL_LENGTH, NEAR, SIZE

Floats = NDArray[np.float64]

ROOM = 1.0 / 32
"""Pixels by which an edge may be drawn elsewhere: ten times what it may move where the places of
corners are rounded to 1/256, as renderers do."""
DEPTH_ROOM = 5e-4
"""Metres by which something may be drawn in front of what is nearer: a hundred times what depths of
single precision between 1 cm and 100 m are good for at a metre."""


class _Meetings(NamedTuple):
    """Where triangles may be drawn: one row for each triangle and middle of a pixel.

    Attributes:
        triangle: its number.
        pixel: its number.
        surely: whether it is drawn there if nothing is in front.
        nearest: the least depth that it may have there, m.
        farthest: the greatest.
    """

    triangle: NDArray[np.intp]
    pixel: NDArray[np.intp]
    surely: NDArray[np.bool_]
    nearest: Floats
    farthest: Floats


def shown_triangles(corners: Floats) -> NDArray[np.bool_]:
    """For each triangle whether a pixel can show it when nothing else is in the way.

    Triangles that turn their backs to the camera may or may not be drawn by the renderer; none of
    them is taken to hide another.

    Args:
        corners: of the triangles, (n, 3, 3), metres in the camera's frame: x right, y down,
            z forward (OpenCV).

    Returns:
        (n); true for all triangles that reach behind the near plane.
    """
    cut: NDArray[np.bool_] = corners[..., 2].min(axis=1) < NEAR
    numbers = np.flatnonzero(~cut)
    meetings = _meetings(corners[numbers])
    hidden_from = np.full(SIZE * SIZE, np.inf)
    sure = meetings.surely
    np.minimum.at(hidden_from, meetings.pixel[sure], meetings.farthest[sure])
    seen = meetings.nearest <= hidden_from[meetings.pixel] + DEPTH_ROOM
    shown = cut.copy()
    shown[numbers[meetings.triangle[seen]]] = True
    return shown


def _meetings(corners: Floats) -> _Meetings:
    """Of triangles (n, 3, 3) in front of the camera with the middles of its pixels."""
    places = FOCAL_LENGTH * corners[..., :2] / corners[..., 2:] + SIZE / 2
    triangle, middle = _candidates(places)
    depths = 1.0 / corners[triangle, :, 2]  # is linear in a picture
    apart, turn = _inside(places[triangle], middle)
    depth, slope = _plane(places[triangle], depths, middle)
    low, high = depths.min(axis=1), depths.max(axis=1)
    column, row = middle.astype(np.intp).T
    near = ~(apart < -ROOM)
    met = _Meetings(
        triangle,
        row * SIZE + column,
        (apart > ROOM) & (turn < 0),
        1.0 / np.fmin(depth + slope * ROOM, high),
        1.0 / np.fmax(depth - slope * ROOM, low),
    )
    return _Meetings._make(field[near] for field in met)


def _candidates(places: Floats) -> tuple[NDArray[np.intp], Floats]:
    """Triangles and the middles of pixels in the boxes around them."""
    low = np.clip(np.ceil(places.min(axis=1) - ROOM - 0.5), 0, SIZE).astype(np.intp)
    high = np.clip(np.floor(places.max(axis=1) + ROOM - 0.5), -1, SIZE - 1).astype(np.intp)
    width, height = np.maximum(high - low + 1, 0).T
    count = width * height
    triangle = np.repeat(np.arange(len(places)), count)
    place = np.arange(count.sum()) - np.repeat(np.cumsum(count) - count, count)
    row, column = np.divmod(place, width[triangle])
    return triangle, low[triangle] + np.stack([column, row], axis=1) + 0.5


def _inside(places: Floats, middle: Floats) -> tuple[Floats, Floats]:
    """How far points (n, 2) are inside triangles (n, 3, 2), pixels, and the triangles' turn.

    A triangle whose corners come anticlockwise for the one who looks has a negative turn.
    """
    along = np.roll(places, -1, axis=1) - places
    turn = _cross(along[:, 0], along[:, 1])
    distances = _cross(along, middle[:, None] - places)
    with np.errstate(invalid="ignore", divide="ignore"):
        distances /= np.linalg.norm(along, axis=-1)
    return np.nanmin(np.sign(turn)[:, None] * distances, axis=1, initial=np.inf), turn


def _plane(places: Floats, depths: Floats, middle: Floats) -> tuple[Floats, Floats]:
    """Inverse depth of triangles at points, and how much it changes with a pixel; may be NaN."""
    along, rise = places[:, 1:] - places[:, :1], depths[:, 1:] - depths[:, :1]
    with np.errstate(invalid="ignore", divide="ignore"):
        turn = _cross(along[:, 0], along[:, 1])
        slope_x = (rise[:, 0] * along[:, 1, 1] - rise[:, 1] * along[:, 0, 1]) / turn
        slope_y = (rise[:, 1] * along[:, 0, 0] - rise[:, 0] * along[:, 1, 0]) / turn
        x, y = (middle - places[:, 0]).T
        depth = depths[:, 0] + slope_x * x + slope_y * y
        return depth, np.abs(slope_x) + np.abs(slope_y)


def _cross(first: Floats, second: Floats) -> Floats:
    """Of vectors (..., 2)."""
    return np.asarray(first[..., 0] * second[..., 1] - first[..., 1] * second[..., 0])
