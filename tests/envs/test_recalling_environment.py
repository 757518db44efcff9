"""Equal actions in a scene are simulated once, and what is returned is the same."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import roboirg
from roboirg.envs import recollection as kept
from roboirg.envs.recalling_environment import RecallingEnv
from roboirg.envs.recollection import Recollection
from roboirg.simulation.physics_settings import HOME_ACTION
from roboirg.simulation.world import World
from roboirg.tasks.splits.splits import get_episode

pytestmark = pytest.mark.sim

SEEN = {"cameras": ("front",), "observe_every": 3, "demonstration_frames": 8}
BLIND = {"cameras": (), "observe_every": 2, "max_steps": 14}
MOVES = tuple(np.tile(np.asarray(HOME_ACTION) + change, (3, 1)) for change in (0.0, 0.03, -0.02))


def environments(recollection, setting, task="VideoUnmask", index=0, **options):
    """Return a recalling environment and a plain one of the same episode and words."""
    episode = get_episode(task, "val", index)
    options = {**options, "setting": setting}
    return RecallingEnv(episode, recollection, **options), roboirg.make(episode, **options)


def assert_equal(one, other):
    """Assert that what two environments returned is the same, to the bit."""
    if isinstance(one, dict) or hasattr(one, "keys"):
        assert set(one) == set(other)
        for key in one:
            assert_equal(one[key], other[key])
    elif isinstance(one, tuple | list):
        assert len(one) == len(other)
        for first, second in zip(one, other, strict=True):
            assert_equal(first, second)
    elif isinstance(one, np.ndarray):
        assert one.dtype == other.dtype
        assert np.array_equal(one, other)
    else:
        assert one == other


def play_both(pair, moves):
    """Play the same moves in both, and assert that they return the same."""
    ours, plain = pair
    assert_equal(ours.reset(), plain.reset())
    over = False
    for move in moves:
        if not over:
            result = plain.step_chunk(MOVES[move])
            assert_equal(ours.step_chunk(MOVES[move]), result)
            assert ours.executed_actions == plain.executed_actions
            assert ours.due_stage == plain.due_stage
            over = result[4]["status"] != "ongoing"
    assert_equal(ours.end_state(), plain.end_state())
    assert_equal(ours.end_state(), plain.end_state())


@pytest.fixture
def started(monkeypatch):
    """The worlds that were built."""
    built = []
    begin = World.__init__

    def count(self, *args, **options):
        built.append(self)
        begin(self, *args, **options)

    monkeypatch.setattr(World, "__init__", count)
    return built


def test_other_words_and_the_same_actions_need_no_simulator(started):
    recollection = Recollection()
    play_both(environments(recollection, "explicit", **SEEN), (0, 1, 1))
    ours, plain = environments(recollection, "direct", **SEEN)
    result = plain.reset()
    before = len(started)
    assert_equal(ours.reset()[0], result[0])
    for move in (0, 1, 1):
        observation, *_ = ours.step_chunk(MOVES[move])
        assert observation["instruction"] == plain.instruction.text
        assert {one["instruction"] for one in observation["history"]} == {plain.instruction.text}
    ours.end_state()
    assert np.array_equal(ours.picture("front"), observation["front_rgb"])
    assert len(started) == before


def test_other_actions_are_simulated_from_where_they_differ(started):
    recollection = Recollection()
    for setting, moves in (("explicit", (0, 1, 1)), ("direct", (0, 2, 1)), ("reasoning", (0, 2))):
        play_both(environments(recollection, setting, **SEEN), moves)
    before = len(started)
    ours, _ = environments(recollection, "contextual", **SEEN)
    ours.reset()
    ours.step_chunk(MOVES[0])
    point = (128, 128)
    found = ours.objects_at(point)
    assert len(started) == before + 1
    again, plain = environments(recollection, "explicit", **SEEN)
    for env in (again, plain):
        env.reset()
        env.step_chunk(MOVES[0])
    assert again.objects_at(point) == found == plain.objects_at(point)


@settings(max_examples=60, deadline=None)
@given(st.lists(st.lists(st.sampled_from((0, 1, 2)), max_size=5), min_size=2, max_size=4))
def test_any_order_of_actions_gives_what_the_simulator_gives(plays):
    recollection = Recollection()
    for setting, moves in zip(
        ("explicit", "direct", "reasoning", "contextual"), plays, strict=False
    ):
        play_both(environments(recollection, setting, "PickXtimes", **BLIND), moves)


def test_the_words_of_a_reset_stay_when_the_simulator_catches_up():
    recollection = Recollection()
    for changed in ({"setting": "direct"}, {"arm": "silent"}, {"setting": "reasoning"}):
        ours, plain = environments(recollection, "explicit", **SEEN)
        for env in (ours, plain):
            env.reset(options=changed)
        for move in (0, 0, 1):
            assert_equal(ours.step_chunk(MOVES[move]), plain.step_chunk(MOVES[move]))
            assert ours.objects_at((128, 100 + move)) == plain.objects_at((128, 100 + move))


def test_arms_with_another_goal_alternate_with_the_told_one(started):
    recollection = Recollection()
    for arm in ("told", "other-goal"):
        play_both(environments(recollection, "explicit", arm=arm, **SEEN), (0, 1))
    before = len(started)
    for arm in ("told", "other-goal"):
        ours, plain = environments(recollection, "direct", arm=arm, **SEEN)
        assert ours.reset()[0]["instruction"] == plain.instruction.text
        for move in (0, 1):
            ours.step_chunk(MOVES[move])
    assert len(started) == before


def test_what_is_known_stays_known_when_a_new_point_needs_the_simulator(started):
    recollection = Recollection()
    for column, worlds in ((100, 1), (101, 1), (100, 0), (101, 0)):
        before = len(started)
        ours, _ = environments(recollection, "explicit", **SEEN)
        ours.reset()
        ours.step_chunk(MOVES[0])
        ours.objects_at((128, column))
        ours.step_chunk(MOVES[1])
        assert len(started) - before == worlds


def test_another_scene_is_another_matter():
    recollection = Recollection()
    for index in (0, 1, 0):
        play_both(environments(recollection, "explicit", "PickXtimes", index, **BLIND), (1, 1))


def test_other_options_are_another_matter():
    recollection = Recollection()
    for limit in (4, 14):
        options = {**BLIND, "max_steps": limit}
        play_both(environments(recollection, "explicit", "PickXtimes", **options), (1, 1))


def test_what_does_not_fit_is_simulated(monkeypatch, started):
    monkeypatch.setattr(kept, "MOST_BYTES", 400_000)
    recollection = Recollection()
    for setting in ("explicit", "direct"):
        before = len(started)
        play_both(environments(recollection, setting, **SEEN), (0, 1, 1))
        assert len(started) >= before + 2
