"""Places on the table, and the ranks that objects tell."""

import numpy as np
import pytest

from roboirg_learn.listener.object_relations import (
    SeenObjects,
    TablePlane,
    fit_plane,
    locate_and_rank,
    relation_count,
    without_objects,
)

CLASSES = ("button", "container", "cube blue", "cube red")
CORNERS = np.array([(x, y) for x in (-0.3, 0.2) for y in (-0.4, 0.3)])
FLAT = TablePlane(np.eye(3), CORNERS)
LEFT, FORWARD, DISTANCE = range(3)
FIXED = 7
CODES = 6
RANKS = 3


def objects_of(*items):
    """Objects given by class, x and y; with `FLAT`, the picture is the table."""
    kinds = np.array([CLASSES.index(name) for name, _, _ in items], np.int64)
    places = np.array([(x, y) for _, x, y in items], np.float32).reshape(-1, 2)
    return SeenObjects(kinds, places)


def scene_of(*views):
    return locate_and_rank([objects_of(*view) for view in views], FLAT, CLASSES)


def ranks_of(scene, number, landmark):
    """The ranks of an object from the first and from the last, where they are told."""
    told = scene.relations[number, landmark * CODES : (landmark + 1) * CODES]
    return list(np.flatnonzero(told[:RANKS])), list(np.flatnonzero(told[RANKS:]))


def landmark_of(name, view=0):
    return FIXED + view * len(CLASSES) + CLASSES.index(name)


def test_the_table_plane_is_fitted_from_points_in_picture_and_world():
    """From 30 points of a known projection the same projection is found again.

    The matrix converts a place in the picture to one on the table; the corners of the found plane
    are the outermost of its points.
    """
    rng = np.random.default_rng(0)
    matrix = np.array([[0.9, -0.2, 0.1], [0.1, -1.1, 0.4], [0.3, 0.2, 1.0]])
    places = rng.random((30, 2))
    positions = TablePlane(matrix, CORNERS).find(places)

    found = fit_plane(places, positions)

    assert found.find(places) == pytest.approx(positions, abs=1e-9)
    assert found.corners.min(axis=0) == pytest.approx(positions.min(axis=0))
    assert found.corners.max(axis=0) == pytest.approx(positions.max(axis=0))


@pytest.mark.parametrize(
    ("landmark", "ranks"),
    [
        (LEFT, [([0], [2]), ([1], [1]), ([2], [0])]),
        (FORWARD, [([0], [2]), ([2], [0]), ([1], [1])]),
        (DISTANCE, [([0], [2]), ([1], [1]), ([2], [0])]),
    ],
    ids=["from the left", "from the near end", "from the robot"],
)
def test_cubes_are_ranked_among_cubes_whatever_their_color(landmark, ranks):
    """Of three cubes, each given by color, x and y in meters, the ranks are counted from both ends.

    The robot stands at 0 and looks along x; its left is at larger y. ([0], [2]) is the first of
    three and the third last, counted from 0.
    """
    scene = scene_of([("cube red", 0.0, 0.2), ("cube blue", 0.1, 0.0), ("cube red", 0.05, -0.3)])

    assert [ranks_of(scene, cube, landmark) for cube in range(3)] == ranks


def test_the_only_button_is_the_first_and_the_last_of_its_kind():
    """Next to two cubes stands one button; ranks are counted among things of one kind, from 0."""
    scene = scene_of([("cube red", 0.0, 0.2), ("cube red", 0.05, -0.3), ("button", -0.2, 0.25)])
    button = 2

    assert ranks_of(scene, button, LEFT) == ([0], [0])


def test_cubes_are_ranked_by_their_distance_to_a_button_or_to_another_cube():
    """Each thing is given by kind, x and y in meters, with the robot's left at larger y.

    The button stands at the left, so that the left cube is the nearest (rank 0) and the right one
    the farthest (0 from the end). From the blue cube the two others are ranked, and it is not.
    """
    left_cube, blue_cube, right_cube = range(3)
    scene = scene_of([
        ("cube red", 0.0, 0.2),
        ("cube blue", 0.1, 0.0),
        ("cube red", 0.05, -0.3),
        ("button", -0.2, 0.25),
    ])  # fmt: skip

    assert ranks_of(scene, left_cube, landmark_of("button")) == ([0], [2])
    assert ranks_of(scene, right_cube, landmark_of("button")) == ([2], [0])
    assert ranks_of(scene, left_cube, landmark_of("cube blue")) == ([0], [1])
    assert ranks_of(scene, blue_cube, landmark_of("cube blue")) == ([], [])


TWO_CUBES_THEN_THREE_CONTAINERS = (
    [("cube red", 0.0, 0.2), ("cube blue", 0.0, -0.2)],
    [("container", 0.01, -0.2), ("container", 0.0, 0.0), ("container", 0.0, 0.21)],
)
"""What two pictures show. Objects 0 and 1 are the cubes, 2 to 4 the containers."""


def test_containers_are_ranked_by_their_distance_to_cubes_of_an_earlier_picture():
    """Container 4 is the nearest of three to where the red cube was, and 2 to the blue one."""
    scene = scene_of(*TWO_CUBES_THEN_THREE_CONTAINERS)

    assert ranks_of(scene, 4, landmark_of("cube red")) == ([0], [2])
    assert ranks_of(scene, 2, landmark_of("cube blue")) == ([0], [2])


def test_each_object_of_a_scene_belongs_to_the_picture_that_shows_it():
    """The first picture shows two cubes, the second three containers."""
    scene = scene_of(*TWO_CUBES_THEN_THREE_CONTAINERS)

    assert scene.looks == 2
    assert list(scene.views) == [0, 0, 1, 1, 1]


def test_a_scene_without_looks_has_no_objects_and_no_relations():
    """A cube is taken out of a scene; relations to landmarks keep their number of columns."""
    unseen = without_objects(scene_of([("cube red", 0.0, 0.0)]))
    assert unseen.looks == 0
    assert all(len(part) == 0 for part in unseen[:4])
    assert unseen.relations.shape[1] == relation_count(len(CLASSES))
