"""Where the objects of pictures stand on the table, and how they rank among their kind.

Words such as *the cube second closest to the button* name a rank. Each object has its ranks
itself, so that a small network need not count and compare places.

A landmark is what objects of a kind are ordered by: two directions, the robot, the corners of the
area where objects stand, and every object. The first and the last few have a rank there.
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
"""How many of the first, and as many of the last, have a rank in an order."""
_CODES_PER_LANDMARK = 2 * _RANKS
"""Ranks at one landmark: of the first, then of the last."""
_FIXED_LANDMARKS = 7
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
    """Return the map from places in a picture to the table that fits n known points best.

    It is a homography, found by least squares; its ninth coefficient is set to 1.

    Args:
        places: (n, 2) column and row, as shares of the picture's size.
        positions: (n, 2) x and y on the table, m.
    """
    count = len(places)
    columns = np.column_stack([places, np.ones(count)])
    zeros = np.zeros_like(columns)
    x = positions[:, :1]
    y = positions[:, 1:]
    # x = (a·c + b·r + d) / (g·c + h·r + 1) is linear in the unknowns a to h; so is y.
    of_x = np.hstack([columns, zeros, -places * x])
    of_y = np.hstack([zeros, columns, -places * y])
    coefficients = np.linalg.lstsq(np.vstack([of_x, of_y]), positions.T.reshape(-1), rcond=None)[0]
    matrix = np.append(coefficients, 1.0).reshape(3, 3)
    return TablePlane(matrix, corners_of(positions))


def corners_of(positions: NDArray[np.floating]) -> Points:
    """Return the corners (4, 2), x and y, m, of the rectangle around positions (n, 2)."""
    left, near = positions.min(axis=0)
    right, far = positions.max(axis=0)
    return np.array([(left, near), (left, far), (right, near), (right, far)], np.float64)


def relation_count(classes: int) -> int:
    """Return how many ranks `relations` has columns for, given the number of classes."""
    return (_FIXED_LANDMARKS + VIEWS * classes) * _CODES_PER_LANDMARK


def locate_and_rank(
    views: Sequence[SeenObjects], plane: TablePlane, classes: Sequence[str]
) -> ObjectsInView:
    """Return where the objects of pictures stand on the table, and how they rank among their kind.

    Args:
        views: the objects found in each picture, one or two.
        plane: maps places in a picture to the table.
        classes: names of classes; the first word of each is its kind.
    """
    positions = plane.find(np.concatenate([view.places for view in views]))
    kinds = [view.kinds for view in views]
    return rank_objects(kinds, positions, plane.corners, classes)


def rank_objects(
    views: Sequence[NDArray[np.int64]], positions: Points, corners: Points, classes: Sequence[str]
) -> ObjectsInView:
    """Return objects, given where they stand, with their ranks among their kind.

    A rank is such as *second closest to the button*, among the cubes of the same picture.

    Args:
        views: the numbers of classes of the objects of each picture, one or two.
        positions: (n, 2) x and y of all of them, m.
        corners: (4, 2) of the area where objects stand, m.
        classes: names of classes; the first word of each is its kind.
    """
    view_numbers = np.repeat(np.arange(len(views)), [len(kinds) for kinds in views])
    scene = _Scene(np.concatenate(list(views)), view_numbers, positions, corners, len(classes))
    relations = np.zeros((len(positions), relation_count(len(classes))), np.uint8)
    for members in _groups_of_one_kind(scene, classes):
        for order in _landmark_orders(members, scene):
            _note_ranks(relations, order)
    stored_positions = positions.astype(np.float32)
    return ObjectsInView(scene.kinds, view_numbers, stored_positions, relations, len(views))


def without_objects(seen: ObjectsInView) -> ObjectsInView:
    """Return the same without any objects or pictures, as of a scene that is not looked at."""
    return ObjectsInView(
        seen.kinds[:0], seen.views[:0], seen.positions[:0], seen.relations[:0], looks=0
    )


class _Scene(NamedTuple):
    """All objects of the pictures of a scene; fields as in `ObjectsInView` and `TablePlane`."""

    kinds: NDArray[np.int64]
    views: NDArray[np.int64]
    positions: Points
    corners: Points
    class_count: int


def _groups_of_one_kind(scene: _Scene, classes: Sequence[str]) -> Iterator[NDArray[np.int64]]:
    """Yield the numbers of the objects of each kind in each picture.

    The kind is the first word of the class: a red and a blue cube are both cubes.
    """
    first_words = np.array([name.split()[0] for name in classes])
    names = first_words[scene.kinds]
    for view in set(scene.views.tolist()):
        is_in_view = scene.views == view
        for name in set(names[is_in_view].tolist()):
            yield np.flatnonzero(is_in_view & (names == name))


class _LandmarkOrder(NamedTuple):
    """Objects (n,), and the value (n,) by which a landmark, given by its number, orders them."""

    landmark: int
    objects: NDArray[np.int64]
    values: Points


def _landmark_orders(members: NDArray[np.int64], scene: _Scene) -> Iterator[_LandmarkOrder]:
    """Yield for every landmark the values by which it orders objects of one kind.

    Landmark 0 orders from the robot's left, 1 from near to far; the others by distance: from the
    robot, from the four corners, and from every object of the scene, by its picture and class.

    Args:
        members: (n,) numbers of the objects.
        scene: that they are in.
    """
    positions = scene.positions[members]
    yield _LandmarkOrder(0, members, -positions[:, 1])
    yield _LandmarkOrder(1, members, positions[:, 0])
    fixed_points = np.vstack([[ROBOT_BASE[:2]], scene.corners])
    for number, point in enumerate(fixed_points, start=2):
        yield _LandmarkOrder(number, members, _distances(positions, point))

    for other, position in enumerate(scene.positions):
        # An object has no rank at itself.
        rest = members[members != other]
        first_of_view = int(scene.views[other]) * scene.class_count
        landmark = _FIXED_LANDMARKS + first_of_view + int(scene.kinds[other])
        yield _LandmarkOrder(landmark, rest, _distances(scene.positions[rest], position))


def _distances(positions: Points, point: Points) -> Points:
    """Return how far positions (n, 2) are from a point (2,), m: (n,)."""
    return np.asarray(np.linalg.norm(positions - point, axis=1), np.float64)


def _note_ranks(relations: NDArray[np.uint8], order: _LandmarkOrder) -> None:
    """Mark the objects with the `_RANKS` least and greatest values at a landmark, in place.

    Args:
        relations: (all objects, all ranks); becomes 1 where an object has a rank. A landmark has
            `_CODES_PER_LANDMARK` columns: first, second, third; last, last but one, …
        order: objects with their values.
    """
    sorted_objects = order.objects[np.argsort(order.values, kind="stable")]
    column = order.landmark * _CODES_PER_LANDMARK
    for rank_number, least in enumerate(sorted_objects[:_RANKS]):
        relations[least, column + rank_number] = 1
    for rank_number, greatest in enumerate(sorted_objects[::-1][:_RANKS]):
        relations[greatest, column + _RANKS + rank_number] = 1
