"""A planner's subgoal against the stage that is due."""

from __future__ import annotations

import pytest

from roboirg.core.conditions import Fact
from roboirg.core.subgoal_text import split_point
from roboirg.judging import judge_subgoal, plain_subgoal
from roboirg.tasks import every_task
from roboirg.tasks.splits.splits import get_episode


def verdict_on(said, due, episode, pointed_at=None):
    points = None if pointed_at is None else {str(point) for point in pointed_at}
    return judge_subgoal(said, due, points, episode)


def test_a_point_in_a_subgoal_is_separated_from_its_words():
    """Planners may name a pixel, <x, y>, of the thing they mean."""
    assert split_point("pick up the cube at <12, 200> now") == ("pick up the cube now", (12, 200))
    assert split_point("put it down") == ("put it down", None)


@pytest.mark.parametrize("task", every_task())
def test_the_subgoal_that_is_due_is_right_and_nonsense_is_called_lost(task):
    """*Lost* is the verdict on a subgoal whose act is not the one that is due."""
    episode = get_episode(task, "test", 3)
    for stage in episode.stages:
        words = plain_subgoal(stage)
        assert verdict_on(words, stage, episode) == "right"
        assert verdict_on(f"{words.upper()}.", stage, episode) == "right"
        assert verdict_on("dance", stage, episode) == verdict_on(words, None, episode) == "lost"
        for other in episode.stages:
            if other.primitive.kind != stage.primitive.kind:
                assert verdict_on(plain_subgoal(other), stage, episode) != "right"


@pytest.mark.parametrize(
    ("task", "number", "said", "expected"),
    [
        ("PickXtimes", 0, "pick up the green cube for the first time", "right"),
        ("PickXtimes", 0, "pick up the green cube", "right"),
        ("PickXtimes", 0, "pick the green cube up", "right"),
        ("PickXtimes", 0, "pick up the green cube for the second time", "wrong_count"),
        ("PickXtimes", 0, "pick up the green cube for the 12th time", "wrong_count"),
        ("PickXtimes", 0, "pick up the blue cube for the first time", "wrong_thing"),
        ("PickXtimes", 0, "press the button to stop", "lost"),
        ("PickXtimes", 1, "place the green cube onto the target", "right"),
        ("PickXtimes", 1, "put the green cube on the target", "right"),
        ("PickXtimes", 1, "put the blue cube on the target", "wrong_thing"),
        ("PickXtimes", 1, "place the green cube onto the table", "wrong_place"),
        ("PickXtimes", 1, "", "lost"),
        ("BinFill", 0, "pick up the third red cube", "wrong_count"),
        ("BinFill", 0, "pick up the red cube", "right"),
        ("ButtonUnmaskSwap", 0, "press the second button", "right"),
        ("ButtonUnmaskSwap", 0, "press the button", "right"),
        ("SwingXtimes", 1, "move to the top of the left-side target", "wrong_place"),
        ("SwingXtimes", 7, "put the green cube on the table", "right"),
        # It points at nothing, so no cube is meant but the one in the hand.
        ("SwingXtimes", 7, "put the red cube on the table", "wrong_thing"),
        ("PutInBox", 1, "put it into the green box", "wrong_place"),
        ("StopCube", 1, "remain static for 30 steps", "right"),
    ],
)
def test_a_subgoal_is_judged_by_what_is_wrong_with_it(task, number, said, expected):
    """`number` is the stage that is due, and *lost* the verdict if its act is another one."""
    index = {"PutInBox": 30, "SwingXtimes": 3}.get(task, 0)
    episode = get_episode(task, "test", index)
    assert verdict_on(said, episode.stages[number], episode) == expected


def test_a_point_at_a_wrong_object_makes_a_subgoal_with_right_words_wrong():
    """The last argument holds the objects that the planner's point is on."""
    episode = get_episode("VideoPlaceOrder", "test", 0)
    pick, place = episode.stages[:2]
    assert verdict_on(plain_subgoal(pick), pick, episode, {pick.points_at}) == "right"
    assert verdict_on(plain_subgoal(pick), pick, episode, {"target_0"}) == "wrong_thing"
    assert verdict_on("pick the cube up", pick, episode, {"target_0"}) == "wrong_thing"
    assert verdict_on(plain_subgoal(place), place, episode, {place.points_at, "cube"}) == "right"
    assert verdict_on(plain_subgoal(place), place, episode, set()) == "wrong_place"

    waits = get_episode("StopCube", "test", 0)
    assert verdict_on("remain static", waits.stages[1], waits, {"button"}) == "right"


def test_a_subgoal_may_name_any_cube_of_a_goal_color_until_these_are_in_the_bin():
    """The scene has one blue cube and four green ones; then the blue one is in the bin."""
    episode = get_episode("BinFill", "test", 7)  # one blue cube and four green ones
    first = episode.stages[0]
    for color, last in (("blue", "cube_blue_3"), ("green", "cube_green_5")):
        assert verdict_on(f"pick up the {color} cube", first, episode) == "right"
        assert verdict_on("pick up the cube", first, episode, {last}) == "right"

    done = frozenset({Fact("binned", "cube_blue_3", "bin")})
    said = "pick up the blue cube"
    assert judge_subgoal(said, episode.stages[2], None, episode, done) == "wrong_thing"
