"""Where the objects of pictures stand on the table, and how they rank among their kind.

Words such as *the cube second closest to the button* name a rank. Each object comes with its ranks,
so that a small network need not count and compare positions.

A landmark is what objects of a kind are ordered by: two directions, the robot, the corners of the
area where objects stand, and every object. The first and the last few have a rank there. A view is
a picture in which objects are seen, by its number.
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
        classes: (n,) class numbers, from 0.
        centers: (n, 2) column and row, as shares of the picture's size.
    """

    classes: NDArray[np.int64]
    centers: NDArray[np.float32]


class TablePlane(NamedTuple):
    """Where on the table the points of a picture are: a homography.

    Attributes:
        matrix: (3, 3), from column and row, as shares of the picture's size, to x and y, m.
        corners: (4, 2) x and y of the corners of the area where objects stand, m.
    """

    matrix: Points
    corners: Points

    def find(self, centers: NDArray[np.floating]) -> Points:
        """Return x and y (n, 2) on the table, m, of points (n, 2) in a picture, as shares."""
        mapped = np.column_stack([centers, np.ones(len(centers))]) @ self.matrix.T
        return np.asarray(mapped[:, :2] / mapped[:, 2:], np.float64)


class ObjectsInView(NamedTuple):
    """All objects seen, of one or two pictures.

    Attributes:
        classes: (n,) class numbers, from 0.
        views: (n,) the picture of each, from 0.
        positions: (n, 2) x and y on the table, m.
        relations: (n, `relation_count`) 1 where an object has a rank, else 0; see `_mark_ranks`.
        looks: number of pictures.
    """

    classes: NDArray[np.int64]
    views: NDArray[np.int64]
    positions: NDArray[np.float32]
    relations: NDArray[np.uint8]
    looks: int


def fit_plane(centers: NDArray[np.floating], positions: NDArray[np.floating]) -> TablePlane:
    """Return the map from points of a picture to the table that fits n known points best.

    It is a homography, found by least squares; its ninth coefficient is set to 1.

    Args:
        centers: (n, 2) column and row, as shares of the picture's size.
        positions: (n, 2) x and y on the table, m.
    """
    homogeneous = np.column_stack([centers, np.ones(len(centers))])
    zeros = np.zeros_like(homogeneous)
    x = positions[:, :1]
    y = positions[:, 1:]
    # x = (a·c + b·r + d) / (g·c + h·r + 1) is linear in the unknowns a to h; so is y.
    of_x = np.hstack([homogeneous, zeros, -centers * x])
    of_y = np.hstack([zeros, homogeneous, -centers * y])
    every_x_then_y = positions.T.reshape(-1)
    coefficients = np.linalg.lstsq(np.vstack([of_x, of_y]), every_x_then_y, rcond=None)[0]
    matrix = np.append(coefficients, 1.0).reshape(3, 3)
    return TablePlane(matrix, corners_of(positions))


def corners_of(positions: NDArray[np.floating]) -> Points:
    """Return the corners (4, 2), x and y, m, of the rectangle around positions (n, 2).

    The order is that of landmarks in trained networks.
    """
    low_x, low_y = positions.min(axis=0)
    high_x, high_y = positions.max(axis=0)
    corners = [(low_x, low_y), (low_x, high_y), (high_x, low_y), (high_x, high_y)]
    return np.array(corners, np.float64)


def relation_count(classes: int) -> int:
    """Return how many columns `ObjectsInView.relations` has, given the number of classes.

    Landmarks are the fixed ones and each class in each view; each has `_CODES_PER_LANDMARK` ranks.
    """
    return (_FIXED_LANDMARKS + VIEWS * classes) * _CODES_PER_LANDMARK


def locate_and_rank(
    views: Sequence[SeenObjects], plane: TablePlane, class_names: Sequence[str]
) -> ObjectsInView:
    """Return where the objects of pictures stand on the table, and how they rank among their kind.

    Args:
        views: the objects found in each picture, one or two.
        plane: maps points of a picture to the table.
        class_names: in the order of their numbers; the first word of each is its kind.
    """
    positions = plane.find(np.concatenate([view.centers for view in views]))
    classes_of_views = [view.classes for view in views]
    return rank_objects(classes_of_views, positions, plane.corners, class_names)


def rank_objects(
    classes_of_views: Sequence[NDArray[np.int64]],
    positions: Points,
    corners: Points,
    class_names: Sequence[str],
) -> ObjectsInView:
    """Return objects, given where they stand, with their ranks among their kind.

    A rank is such as *second closest to the button*, among the cubes of the same picture.

    Args:
        classes_of_views: the class numbers of the objects of each picture, one or two.
        positions: (n, 2) x and y of all of them, m, those of the first picture first.
        corners: (4, 2) x and y of the corners of the area where objects stand, m.
        class_names: in the order of their numbers; the first word of each is its kind.
    """
    objects_per_view = [len(classes) for classes in classes_of_views]
    views = np.repeat(np.arange(len(classes_of_views)), objects_per_view)
    classes = np.concatenate(list(classes_of_views))
    scene = _Scene(classes, views, positions, corners, len(class_names))
    relations = np.zeros((len(positions), relation_count(len(class_names))), np.uint8)
    for members in _groups_of_one_kind(scene, class_names):
        for order in _landmark_orders(members, scene):
            _mark_ranks(relations, order)
    stored_positions = positions.astype(np.float32)
    return ObjectsInView(classes, views, stored_positions, relations, len(classes_of_views))


def without_objects(seen: ObjectsInView) -> ObjectsInView:
    """Return the same without any objects or pictures, as of a scene that is not looked at."""
    return ObjectsInView(
        seen.classes[:0], seen.views[:0], seen.positions[:0], seen.relations[:0], looks=0
    )


class _Scene(NamedTuple):
    """All objects of the pictures of a scene; fields as in `ObjectsInView` and `TablePlane`."""

    classes: NDArray[np.int64]
    views: NDArray[np.int64]
    positions: Points
    corners: Points
    class_count: int


def _groups_of_one_kind(scene: _Scene, class_names: Sequence[str]) -> Iterator[NDArray[np.int64]]:
    """Yield the numbers of the objects of each kind in each picture.

    The kind is the first word of the class: a red and a blue cube are both cubes.
    """
    first_words = np.array([name.split()[0] for name in class_names])
    names = first_words[scene.classes]
    for view in set(scene.views.tolist()):
        is_in_view = scene.views == view
        for name in set(names[is_in_view].tolist()):
            yield np.flatnonzero(is_in_view & (names == name))


class _LandmarkOrder(NamedTuple):
    """How a landmark orders objects of one kind.

    Attributes:
        landmark: its number.
        objects: (n,) numbers of the objects, in any order.
        values: (n,) by which they are ordered, the least first.
    """

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
        # An object has no rank at itself. Objects of one class and view share a landmark.
        rest = members[members != other]
        first_of_view = _FIXED_LANDMARKS + int(scene.views[other]) * scene.class_count
        landmark = first_of_view + int(scene.classes[other])
        yield _LandmarkOrder(landmark, rest, _distances(scene.positions[rest], position))


def _distances(positions: Points, point: Points) -> Points:
    """Return how far positions (n, 2) are from a point (2,), m: (n,)."""
    return np.asarray(np.linalg.norm(positions - point, axis=1), np.float64)


def _mark_ranks(relations: NDArray[np.uint8], order: _LandmarkOrder) -> None:
    """Mark the objects with the `_RANKS` least and greatest values at a landmark, in place.

    Args:
        relations: (all objects, all ranks); becomes 1 where an object has a rank. A landmark has
            `_CODES_PER_LANDMARK` columns: first, second, third; last, last but one, …
        order: objects with their values.
    """
    from_least = order.objects[np.argsort(order.values, kind="stable")]
    first_column = order.landmark * _CODES_PER_LANDMARK
    for rank, object_number in enumerate(from_least[:_RANKS]):
        relations[object_number, first_column + rank] = 1
    for rank, object_number in enumerate(from_least[::-1][:_RANKS]):
        relations[object_number, first_column + _RANKS + rank] = 1
