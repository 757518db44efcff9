"""Things that a policy sees: where they are, and which is which from look to look."""

import math

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from roboirg.extension.sight import points_of
from roboirg_learn.policy.moves import LEAST_SHARE, LookDecision, Move, common_moves, waypoint
from roboirg_learn.policy.sight import ObjectClasses
from roboirg_learn.policy.tracks import MOST_TRACKS, Detections, Tracker

OBJECTS = ObjectClasses(("button", "cube red", "target"), np.array([0.01, 0.02, 0.005]))
places = st.tuples(st.floats(-0.25, 0.15), st.floats(-0.25, 0.25))


def look_at(classes, spots):
    count = len(classes)
    yaw_codes = np.tile(np.array([1.0, 0.0], np.float32), (count, 1))
    return Detections(
        np.array(classes, np.int64), np.array(spots, np.float32).reshape(count, 2), yaw_codes
    )


@given(st.lists(st.tuples(places, st.integers(0, 2)), min_size=1, max_size=8))
def test_a_point_in_the_picture_is_converted_to_its_place_on_the_table(things):
    spots = np.array([spot for spot, _ in things])
    classes = np.array([kind for _, kind in things])
    positions = np.column_stack([spots, OBJECTS.heights[classes]])

    found = OBJECTS.table_positions(classes, points_of(positions))

    np.testing.assert_allclose(found, spots, atol=1e-5)


@given(
    st.lists(st.tuples(places, st.integers(0, 2)), min_size=1, max_size=10),
    st.randoms(use_true_random=False),
)
def test_objects_that_stay_keep_their_track_numbers_in_any_order_of_detection(things, rng):
    apart = []
    for spot, kind in things:
        if all(math.dist(spot, other) > 0.02 or kind != like for other, like in apart):
            apart.append((spot, kind))
    order = rng.sample(range(len(apart)), len(apart))
    spots, kinds = zip(*apart, strict=True)
    tracks = Tracker()

    first = tracks.update(look_at(kinds, spots))
    again = tracks.update(look_at([kinds[n] for n in order], [spots[n] for n in order]))

    assert again.tolist() == [first[n] for n in order]
    assert tracks.count == len(apart)
    assert tracks.visible[: tracks.count].all()


def test_two_containers_that_exchange_places_keep_their_track_numbers():
    """They pass each other on opposite sides, as in the videos."""
    tracks = Tracker()
    for share in np.linspace(0.0, 1.0, 8):
        smooth = share * share * (3 - 2 * share)
        aside = 0.07 * math.sin(math.pi * smooth)
        one = (-0.1 + 0.2 * smooth, aside)
        other = (0.1 - 0.2 * smooth, -aside)
        mine = tracks.update(look_at([0, 0], [one, other]))
        assert mine.tolist() == [0, 1], share
    np.testing.assert_allclose(tracks.positions[:2], [(0.1, 0.0), (-0.1, 0.0)], atol=1e-6)


def test_an_object_out_of_sight_keeps_its_place_and_its_track_number():
    """Two objects are seen, then only the second, then the first one at other places."""
    tracks = Tracker()
    tracks.update(look_at([1, 2], [(0.0, 0.1), (0.1, -0.1)]))

    tracks.update(look_at([2], [(0.1, -0.1)]))

    assert tracks.visible[:2].tolist() == [False, True]
    np.testing.assert_allclose(tracks.positions[0], (0.0, 0.1))
    # The way it was carried out of sight is no speed: it need not go on.
    for x in (0.35, 0.2):
        assert tracks.update(look_at([1], [(x, 0.1)])).tolist() == [0]


def test_objects_beyond_the_maximum_number_of_tracks_get_none():
    """Minus one stands for no track."""
    spots = [(0.001 * n, 0.0) for n in range(MOST_TRACKS + 5)]
    mine = Tracker().update(look_at([1] * len(spots), spots))
    assert mine.tolist() == [*range(MOST_TRACKS), *[-1] * 5]


@given(st.floats(-10.0, 10.0), st.floats(-math.pi, math.pi))
def test_a_grasp_takes_the_side_that_needs_the_shortest_turn(now, angle):
    """A cube can be gripped at four angles; the shortest turn is at most π/4."""
    move = Move(True, 0.0, 0.0, 0.02, "align", -1.0)
    tool = np.array([0.3, 0.3, 0.15, math.pi, 0.0, now, 0.04])
    turn = np.array([math.cos(4 * angle), math.sin(4 * angle)])
    found = waypoint(move, tool, np.array([0.1, -0.1]), turn)

    assert found[[0, 1, 2, 6]].tolist() == [0.1, -0.1, 0.02, -1.0]
    assert abs(found[5] - now) <= math.pi / 4 + 1e-9

    quarters = (found[5] - angle) / (math.pi / 2)
    assert abs(quarters - round(quarters)) < 1e-6


def test_a_move_relative_to_the_tool_keeps_the_tool_s_yaw():
    move = Move(False, -0.1, 0.0, 0.2, "keep", 0.0)
    tool = np.array([0.3, 0.2, 0.15, math.pi, 0.0, 1.0, 0.04])

    found = waypoint(move, tool, np.zeros(2), np.array([1.0, 0.0]))

    np.testing.assert_allclose(found, [0.2, 0.2, 0.2, math.pi, 0.0, 1.0, 0.0])


def test_rare_moves_are_not_learned():
    """A move whose share is below `LEAST_SHARE` is left out."""
    usual, rare = (Move(True, 0.0, 0.0, z, "align", 0.0) for z in (0.1, 0.2))
    # One rare move among so many is below the share `LEAST_SHARE`; among three it is not.
    often = [LookDecision(0, usual, 0)] * round(3 / LEAST_SHARE)
    once = [LookDecision(0, rare, 0)]

    assert common_moves([often, once]) == (usual,)
    assert common_moves([often[:3], once]) == (usual, rare)
