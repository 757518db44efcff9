"""A planner's subgoal against the stage that is due."""

from __future__ import annotations

import pytest

from roboirg.core.episode import Stage
from roboirg.core.subgoal_text import split_point
from roboirg.judging import judge_subgoal, plain_subgoal
from roboirg.tasks import every_task
from roboirg.tasks.splits.splits import get_episode


def due(task: str, number: int) -> Stage:
    return get_episode(task, "test", 0).stages[number]


def test_points_are_split_off() -> None:
    assert split_point("pick up the cube at <12, 200> now") == ("pick up the cube now", (12, 200))
    assert split_point("put it down") == ("put it down", None)


@pytest.mark.parametrize("task", every_task())
def test_what_is_due_is_right_and_another_act_is_lost(task: str) -> None:
    stages = get_episode(task, "test", 3).stages
    for stage in stages:
        words = plain_subgoal(stage)
        assert judge_subgoal(words, stage, None) == "right"
        assert judge_subgoal(f"{words.upper()}.", stage, None) == "right"
        assert judge_subgoal("dance", stage, None) == judge_subgoal(words, None, None) == "lost"
        for other in stages:
            if plain_subgoal(other) != words:
                assert judge_subgoal(plain_subgoal(other), stage, None) != "right"


@pytest.mark.parametrize(
    ("task", "number", "said", "verdict"),
    [
        ("PickXtimes", 0, "pick up the green cube for the first time", "right"),
        ("PickXtimes", 0, "pick up the green cube for the second time", "wrong_count"),
        ("PickXtimes", 0, "pick up the green cube for the 12th time", "wrong_count"),
        ("PickXtimes", 0, "pick up the blue cube for the first time", "wrong_thing"),
        ("PickXtimes", 0, "press the button to stop", "lost"),
        ("PickXtimes", 1, "place the green cube onto the target", "right"),
        ("PickXtimes", 1, "place the blue cube onto the target", "wrong_thing"),
        ("PickXtimes", 1, "place the green cube onto the table", "wrong_place"),
        ("PickXtimes", 1, "", "lost"),
        ("BinFill", 0, "pick up the third red cube", "wrong_count"),
        ("StopCube", 1, "remain static for 30 steps", "right"),
    ],
)
def test_what_is_wrong(task: str, number: int, said: str, verdict: str) -> None:
    assert judge_subgoal(said, due(task, number), None) == verdict


def test_a_point_off_the_thing_is_wrong_whatever_the_words() -> None:
    pick, place = get_episode("VideoPlaceOrder", "test", 0).stages[:2]
    assert judge_subgoal(plain_subgoal(pick), pick, {pick.points_at}) == "right"
    assert judge_subgoal(plain_subgoal(pick), pick, {"target_0"}) == "wrong_thing"
    assert judge_subgoal(plain_subgoal(place), place, {place.points_at, "cube"}) == "right"
    assert judge_subgoal(plain_subgoal(place), place, set()) == "wrong_place"
    assert judge_subgoal("remain static", due("StopCube", 1), {"button"}) == "right"
