"""Where the objects of pictures stand on the table, and how they rank among their kind.

Words such as *the cube second closest to the button* name a rank. Each object has its ranks
itself, so that a small network need not count and compare places.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from roboirg.extension.sight import ROBOT_BASE

VIEWS = 2
"""At the start of the video, or else of the policy's turn; and later in the video."""
_RANKS = 3
"""How many of the first and of the last have a rank."""
_CODES = 2 * _RANKS
_FIXED = 7
"""To the robot's left, forward, distance from the robot, and distance from each corner."""

Points = NDArray[np.float64]


class SeenObjects(NamedTuple):
    """The objects found in a picture, the surest first.

    Attributes:
        kinds: (n,) numbers of classes, from 0.
        places: (n, 2) column and row, as shares of the picture's size.
    """

    kinds: NDArray[np.int64]
    places: NDArray[np.float32]


class TablePlane(NamedTuple):
    """What a picture's places are on the table.

    Attributes:
        matrix: (3, 3), from column and row, as shares of the picture's size, to x and y, m.
        corners: (4, 2) x and y of the corners of the area where objects stand, m.
    """

    matrix: Points
    corners: Points

    def find(self, places: NDArray[np.floating]) -> Points:
        """Return x and y (n, 2) on the table, m, of places (n, 2) in a picture."""
        mapped = np.column_stack([places, np.ones(len(places))]) @ self.matrix.T
        return np.asarray(mapped[:, :2] / mapped[:, 2:], np.float64)


class ObjectsInView(NamedTuple):
    """All objects seen, of one or two pictures.

    Attributes:
        kinds: (n,) numbers of classes, from 0.
        views: (n,) the picture of each, from 0.
        positions: (n, 2) x and y on the table, m.
        relations: (n, `relation_count`) 1 where an object has a rank, else 0.
        looks: number of pictures.
    """

    kinds: NDArray[np.int64]
    views: NDArray[np.int64]
    positions: NDArray[np.float32]
    relations: NDArray[np.uint8]
    looks: int


def fit_plane(places: NDArray[np.floating], positions: NDArray[np.floating]) -> TablePlane:
    """Return the plane that fits places (n, 2) in a picture and positions (n, 2) on the table, m.

    The least squares of the equations of a homography, whose last coefficient is 1.
    """
    columns, ones, zeros = places.T, np.ones(len(places)), np.zeros(len(places))
    rows = []
    for axis in range(2):
        own = [*columns, ones]
        other = [zeros] * 3
        shared = [-column * positions[:, axis] for column in columns]
        rows.append(np.column_stack([*(own + other if axis == 0 else other + own), *shared]))
    found = np.linalg.lstsq(np.vstack(rows), positions.T.reshape(-1), rcond=None)[0]
    return TablePlane(np.append(found, 1.0).reshape(3, 3), corners_of(positions))


def corners_of(positions: NDArray[np.floating]) -> Points:
    """Return the corners (4, 2) of the area in which positions (n, 2) lie."""
    low, high = positions.min(axis=0), positions.max(axis=0)
    corners = [(x, y) for x in (low[0], high[0]) for y in (low[1], high[1])]
    return np.array(corners, np.float64)


def relation_count(classes: int) -> int:
    """Return the number of ranks for `classes` classes of objects."""
    return (_FIXED + VIEWS * classes) * _CODES


def relate(
    views: Sequence[SeenObjects], plane: TablePlane, classes: Sequence[str]
) -> ObjectsInView:
    """Return the objects of pictures with their ranks among their kind.

    Args:
        views: one or two.
        plane: of the table.
        classes: names of classes; the first word of each is its kind.
    """
    positions = plane.find(np.concatenate([view.places for view in views]))
    kinds = [view.kinds for view in views]
    return rank(kinds, positions, plane.corners, classes)


def rank(
    views: Sequence[NDArray[np.int64]], positions: Points, corners: Points, classes: Sequence[str]
) -> ObjectsInView:
    """Return objects that stand at positions with their ranks among their kind.

    Args:
        views: the numbers of classes of the objects of each picture, one or two.
        positions: (n, 2) x and y of all of them, m.
        corners: (4, 2) of the area where objects stand, m.
        classes: names of classes; the first word of each is its kind.
    """
    kinds = np.concatenate(list(views))
    where = np.repeat(np.arange(len(views)), [len(view) for view in views])
    relations = np.zeros((len(kinds), relation_count(len(classes))), np.uint8)
    names = np.array([name.split()[0] for name in classes])[kinds]
    groups = {(view, name) for view, name in zip(where, names, strict=True)}
    for view, name in groups:
        members = np.flatnonzero((where == view) & (names == name))
        for landmark, others, values in _orders(members, kinds, where, positions, corners, classes):
            _note_ranks(relations, landmark, others, values)
    return ObjectsInView(kinds, where, positions.astype(np.float32), relations, len(views))


def nothing_of(seen: ObjectsInView) -> ObjectsInView:
    """Return what is seen of a scene that is not looked at."""
    kinds, views, positions, relations, _ = seen
    return ObjectsInView(kinds[:0], views[:0], positions[:0], relations[:0], looks=0)


def _orders(
    members: NDArray[np.int64],
    kinds: NDArray[np.int64],
    where: NDArray[np.int64],
    positions: Points,
    corners: Points,
    classes: Sequence[str],
) -> Iterator[tuple[int, NDArray[np.int64], Points]]:
    """Yield landmarks, with objects of a kind and the value by which the landmark orders them."""
    own = positions[members]
    points = np.vstack([np.array([ROBOT_BASE[:2]]), corners])
    distances = np.linalg.norm(own[:, None] - points[None], axis=2)
    for landmark, values in enumerate([-own[:, 1], own[:, 0], *distances.T]):
        yield landmark, members, values
    for other, (kind, view) in enumerate(zip(kinds, where, strict=True)):
        rest = members[members != other]
        landmark = _FIXED + int(view) * len(classes) + int(kind)
        yield landmark, rest, np.linalg.norm(positions[rest] - positions[other], axis=1)


def _note_ranks(
    relations: NDArray[np.uint8], landmark: int, others: NDArray[np.int64], values: Points
) -> None:
    """Mark in `relations` which objects have the least and the greatest values at a landmark."""
    order = others[np.argsort(values, kind="stable")]
    first = landmark * _CODES
    for number, (least, most) in enumerate(zip(order, order[::-1], strict=True)):
        if number == _RANKS:
            break
        relations[least, first + number] = relations[most, first + _RANKS + number] = 1
