"""Things that a policy sees: where they are, and which is which from look to look."""

import math

import numpy as np
import pytest

from roboirg.extension.sight import points_of
from roboirg_learn.policy.moves import LEAST_SHARE, LookDecision, Move, common_moves, waypoint
from roboirg_learn.policy.sight import ObjectClasses
from roboirg_learn.policy.tracks import MOST_TRACKS, Detections, Tracker

OBJECTS = ObjectClasses(("button", "cube red", "target"), np.array([0.01, 0.02, 0.005]))


def look_at(classes, spots):
    """Return detections of these classes at points (x, y) in meters, all with the same yaw."""
    count = len(classes)
    yaw_codes = np.tile(np.array([1.0, 0.0], np.float32), (count, 1))
    return Detections(
        np.array(classes, np.int64), np.array(spots, np.float32).reshape(count, 2), yaw_codes
    )


@pytest.mark.parametrize("place", [(0.0, 0.0), (0.1, 0.2), (-0.25, -0.1)])
@pytest.mark.parametrize("number", [0, 1, 2], ids=OBJECTS.names)
def test_a_point_in_the_picture_is_converted_to_its_place_on_the_table(number, place):
    """A point of the picture is converted back to the place (x, y) from which it was projected.

    Things have different heights, here 1 cm, 2 cm and 5 mm, which the conversion has to know: the
    camera looks at them from the side.
    """
    point = points_of(np.array([[*place, OBJECTS.heights[number]]]))

    (found,) = OBJECTS.table_positions(np.array([number]), point)

    assert found == pytest.approx(place, abs=1e-5)


def test_objects_that_stay_keep_their_track_numbers_in_any_order_of_detection():
    """Two red cubes (class 1) 10 cm apart, and a target (class 2) under the first one."""
    tracks = Tracker()
    first = tracks.update(look_at([1, 1, 2], [(0.0, 0.0), (0.0, 0.1), (0.0, 0.0)]))

    again = tracks.update(look_at([2, 1, 1], [(0.0, 0.0), (0.0, 0.1), (0.0, 0.0)]))

    assert first.tolist() == [0, 1, 2]
    assert again.tolist() == [2, 1, 0]
    assert tracks.count == 3
    assert tracks.visible[:3].all()


def test_two_containers_that_exchange_places_keep_their_track_numbers():
    """They pass each other on opposite sides, as in the videos: half a circle each, 5 cm wide."""
    tracks = Tracker()

    for angle in np.linspace(0.0, math.pi, 8):
        x = -0.1 * math.cos(angle)
        y = 0.05 * math.sin(angle)
        numbers = tracks.update(look_at([0, 0], [(x, y), (-x, -y)]))
        assert numbers.tolist() == [0, 1], angle

    np.testing.assert_allclose(tracks.positions[:2], [(0.1, 0.0), (-0.1, 0.0)], atol=1e-6)


@pytest.fixture
def tracks_of_a_cube_out_of_sight():
    """A cube, number 0, was seen at (0, 0.1) and then no more; a target, number 1, is in sight."""
    tracks = Tracker()
    tracks.update(look_at([1, 2], [(0.0, 0.1), (0.1, -0.1)]))
    tracks.update(look_at([2], [(0.1, -0.1)]))
    return tracks


def test_an_object_out_of_sight_keeps_its_place(tracks_of_a_cube_out_of_sight):
    """A cube, number 0, was seen once at (0, 0.1) and then no more; a target, number 1, is."""
    assert tracks_of_a_cube_out_of_sight.visible[:2].tolist() == [False, True]
    np.testing.assert_allclose(tracks_of_a_cube_out_of_sight.positions[0], (0.0, 0.1))


def test_an_object_that_is_seen_again_elsewhere_keeps_its_track_number(
    tracks_of_a_cube_out_of_sight,
):
    """It was carried away and back: the way out of sight is no speed that goes on."""
    far = tracks_of_a_cube_out_of_sight.update(look_at([1], [(0.35, 0.1)]))
    nearer = tracks_of_a_cube_out_of_sight.update(look_at([1], [(0.2, 0.1)]))

    assert far.tolist() == nearer.tolist() == [0]


def test_objects_beyond_the_maximum_number_of_tracks_get_none():
    """Minus one stands for no track."""
    spots = [(0.001 * number, 0.0) for number in range(MOST_TRACKS + 2)]

    numbers = Tracker().update(look_at([1] * len(spots), spots))

    assert numbers.tolist() == [*range(MOST_TRACKS), -1, -1]


@pytest.mark.parametrize(
    ("tool_yaw", "cube_yaw", "grasp_yaw"),
    [(0, 30, 30), (0, 80, -10), (200, 30, 210), (-10, 44, -46)],
)
def test_a_grasp_takes_the_side_that_needs_the_shortest_turn(tool_yaw, cube_yaw, grasp_yaw):
    """A cube looks the same after 90 degrees, so it can be gripped at four angles (degrees here).

    The grasp takes the angle next to the yaw of the tool: for a cube at 80 it is -10 with the tool
    at 0, for one at 30 it is 30 + 180 with the tool at 200. The yaw is given as cosine and sine of
    four times the angle.

    A tool is x, y, z (m), roll, pitch, yaw and opening; a waypoint likewise, with the gripper
    command last.
    """
    grasp = Move(at_object=True, x=0.0, y=0.0, z=0.02, turn="align", gripper=-1.0)
    tool = np.array([0.3, 0.3, 0.15, math.pi, 0.0, math.radians(tool_yaw), 0.04])
    angle = math.radians(4 * cube_yaw)
    yaw_code = np.array([math.cos(angle), math.sin(angle)])

    x, y, z, _, _, yaw, gripper = waypoint(grasp, tool, np.array([0.1, -0.1]), yaw_code)

    assert (x, y, z, gripper) == (0.1, -0.1, 0.02, -1.0)
    assert math.degrees(yaw) == pytest.approx(grasp_yaw)


def test_a_move_relative_to_the_tool_keeps_the_tool_s_yaw():
    """From x = 0.3 m, y = 0.2 m the tool goes back by 0.1 m in x, to a height of 0.2 m.

    Its yaw stays 1 rad; no object matters, and gripper command 0 leaves the hand as it is.
    """
    back = Move(at_object=False, x=-0.1, y=0.0, z=0.2, turn="keep", gripper=0.0)
    tool = np.array([0.3, 0.2, 0.15, math.pi, 0.0, 1.0, 0.04])
    unused_place = np.zeros(2)
    unused_yaw_code = np.array([1.0, 0.0])

    found = waypoint(back, tool, unused_place, unused_yaw_code)

    np.testing.assert_allclose(found, [0.2, 0.2, 0.2, math.pi, 0.0, 1.0, 0.0])


@pytest.mark.parametrize(
    ("count", "kept"), [(round(3 / LEAST_SHARE), ["usual"]), (3, ["usual", "rare"])]
)
def test_moves_with_a_share_below_the_least_are_not_learned(count, kept):
    """One rare move among so many is below `LEAST_SHARE`; among three it is not."""
    moves = {
        "usual": Move(True, 0.0, 0.0, 0.1, "align", 0.0),
        "rare": Move(True, 0.0, 0.0, 0.2, "align", 0.0),
    }
    often = [LookDecision(0, moves["usual"], 0)] * count
    once = [LookDecision(0, moves["rare"], 0)]

    assert common_moves([often, once]) == tuple(moves[name] for name in kept)
