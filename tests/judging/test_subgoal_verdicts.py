"""A planner's subgoal against the stage that is due."""

from __future__ import annotations

import pytest

from roboirg.core.conditions import Fact
from roboirg.core.subgoal_text import split_point
from roboirg.judging import judge_subgoal, plain_subgoal
from roboirg.tasks import every_task
from roboirg.tasks.splits.splits import get_episode


def test_a_point_in_a_subgoal_is_separated_from_its_words():
    """Planners may name a pixel, <x, y>, of the thing they mean."""
    assert split_point("pick up the cube at <12, 200> now") == ("pick up the cube now", (12, 200))
    assert split_point("put it down") == ("put it down", None)


@pytest.mark.parametrize("task", every_task())
def test_the_subgoal_that_is_due_is_right_and_nonsense_is_called_lost(task):
    """Each stage of a plan has a subgoal in words, such as "pick up the red cube". The words of the
    stage that is due are right, also in capitals and with a full stop; "dance" is no act of the
    task, which is called *lost*."""
    episode = get_episode(task, "test", 3)
    for stage in episode.stages:
        words = plain_subgoal(stage)

        assert judge_subgoal(words, stage, None, episode) == "right"
        assert judge_subgoal(f"{words.upper()}.", stage, None, episode) == "right"
        assert judge_subgoal("dance", stage, None, episode) == "lost"


def test_any_subgoal_is_lost_when_no_stage_is_due():
    episode = get_episode("PickXtimes", "test", 0)

    assert judge_subgoal("pick up the green cube", None, None, episode) == "lost"


@pytest.mark.parametrize("task", ["SwingXtimes", "BinFill", "ButtonUnmaskSwap"])
def test_the_subgoal_of_a_stage_with_another_act_is_not_right(task):
    """Each stage's own words are judged against every stage with another act, such as a press
    instead of a pick."""
    episode = get_episode(task, "test", 3)
    verdicts = []
    for stage in episode.stages:
        for other in episode.stages:
            if other.primitive.kind != stage.primitive.kind:
                verdicts.append(judge_subgoal(plain_subgoal(other), stage, None, episode))

    assert verdicts
    assert "right" not in verdicts


@pytest.mark.parametrize(
    ("task", "index", "number", "said", "expected"),
    [
        ("PickXtimes", 0, 0, "pick up the green cube for the first time", "right"),
        ("PickXtimes", 0, 0, "pick up the green cube", "right"),
        ("PickXtimes", 0, 0, "pick the green cube up", "right"),
        ("PickXtimes", 0, 0, "pick up the green cube for the second time", "wrong_count"),
        ("PickXtimes", 0, 0, "pick up the green cube for the 12th time", "wrong_count"),
        ("PickXtimes", 0, 0, "pick up the blue cube for the first time", "wrong_thing"),
        ("PickXtimes", 0, 0, "press the button to stop", "lost"),
        ("PickXtimes", 0, 1, "put the green cube on the target", "right"),
        ("PickXtimes", 0, 1, "put the blue cube on the target", "wrong_thing"),
        ("PickXtimes", 0, 1, "place the green cube onto the table", "wrong_place"),
        ("PickXtimes", 0, 1, "", "lost"),
        ("BinFill", 0, 0, "pick up the third red cube", "wrong_count"),
        ("BinFill", 0, 0, "pick up the red cube", "right"),
        ("ButtonUnmaskSwap", 0, 0, "press the second button", "right"),
        ("ButtonUnmaskSwap", 0, 0, "press the button", "right"),
        ("SwingXtimes", 3, 1, "move to the top of the left-side target", "wrong_place"),
        ("SwingXtimes", 3, 7, "put the green cube on the table", "right"),
        # It points at nothing, so no cube is meant but the one in the hand.
        ("SwingXtimes", 3, 7, "put the red cube on the table", "wrong_thing"),
        ("PutInBox", 30, 1, "put it into the green box", "wrong_place"),
        ("StopCube", 0, 1, "remain static for 30 steps", "right"),
    ],
)
def test_a_subgoal_is_judged_by_what_is_wrong_with_it(task, index, number, said, expected):
    """`number` is the stage that is due, and *lost* the verdict if its act is another one.

    In `PickXtimes` the green cube is to be picked up and placed on the target.
    """
    episode = get_episode(task, "test", index)

    verdict = judge_subgoal(said, episode.stages[number], None, episode)

    assert verdict == expected


@pytest.mark.parametrize(
    ("number", "said", "points_at", "expected"),
    [
        (0, "pick up the cube", {"cube_red"}, "right"),
        (0, "pick up the cube", {"target_0"}, "wrong_thing"),
        (0, "pick the cube up", {"target_0"}, "wrong_thing"),
        (1, "place the cube onto the correct target", {"target_2", "cube"}, "right"),
        (1, "place the cube onto the correct target", set(), "wrong_place"),
    ],
)
def test_a_point_at_a_wrong_object_makes_a_subgoal_with_right_words_wrong(
    number, said, points_at, expected
):
    """`points_at` holds the objects at the pixel that the planner names.

    The red cube is to be picked up, and then placed on target_2.
    """
    episode = get_episode("VideoPlaceOrder", "test", 0)

    assert judge_subgoal(said, episode.stages[number], points_at, episode) == expected


def test_a_point_of_a_subgoal_that_needs_none_is_ignored():
    """Stage 1 of StopCube is to hold still, for which nothing is pointed at. That the planner
    points at the button does no harm."""
    episode = get_episode("StopCube", "test", 0)

    assert judge_subgoal("remain static", episode.stages[1], {"button"}, episode) == "right"


@pytest.mark.parametrize(
    ("said", "points_at"),
    [
        ("pick up the blue cube", None),
        ("pick up the green cube", None),
        ("pick up the cube", {"cube_blue_3"}),
        ("pick up the cube", {"cube_green_5"}),
    ],
)
def test_a_subgoal_may_name_any_cube_of_a_goal_color(said, points_at):
    """One blue cube and four green ones are to go into the bin, in any order."""
    episode = get_episode("BinFill", "test", 7)

    assert judge_subgoal(said, episode.stages[0], points_at, episode) == "right"


def test_a_color_whose_cubes_are_all_in_the_bin_is_a_wrong_thing():
    """One blue cube and four green ones are to go into the bin, and the blue one is there."""
    episode = get_episode("BinFill", "test", 7)
    done = frozenset({Fact("binned", "cube_blue_3", "bin")})

    verdict = judge_subgoal("pick up the blue cube", episode.stages[2], None, episode, done)

    assert verdict == "wrong_thing"
