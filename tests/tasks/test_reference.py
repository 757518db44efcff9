"""Videos and plans of the three Reference tasks.

Where things stand is compared with RoboMME in `test_sampler_distributions.py`, and pinned in
`test_splits.py`.
"""

import functools
import itertools

import numpy as np
import pytest
from drawn_scenes import drawn_scenes

from roboirg.core.conditions import Fact
from roboirg.core.episode import DIFFICULTIES, Goal
from roboirg.core.errors import SceneRejectedError
from roboirg.tasks.video_place_button import TASK as VIDEO_PLACE_BUTTON
from roboirg.tasks.video_place_order import TASK as VIDEO_PLACE_ORDER
from roboirg.tasks.video_repick import TASK as VIDEO_REPICK

TASKS = (VIDEO_REPICK, VIDEO_PLACE_BUTTON, VIDEO_PLACE_ORDER)
PLACE_TASKS = (VIDEO_PLACE_BUTTON, VIDEO_PLACE_ORDER)
SEEDS = 120

every_task = pytest.mark.parametrize("task", TASKS, ids=lambda task: task.name)
every_place_task = pytest.mark.parametrize("task", PLACE_TASKS, ids=lambda task: task.name)
every_difficulty = pytest.mark.parametrize("difficulty", DIFFICULTIES)


@functools.cache
def drawn(task, difficulty):
    """Scene and goal of the first seeds that give one."""
    return tuple(itertools.islice(drawn_scenes(task.name, difficulty), SEEDS))


def scenes(task, difficulty):
    return [scene for scene, _ in drawn(task, difficulty)]


def primitives_of(stages):
    """Each stage's primitive in short, with its place if it has one."""
    found = []
    for stage in stages:
        kind, subject, place, *_ = stage.primitive
        found.append((kind, subject) if place is None else (kind, subject, place))
    return found


@every_task
@every_difficulty
def test_a_video_shows_the_facts_of_the_past_in_order_and_can_never_fail(task, difficulty):
    """The past of a scene is what the video shows, and what a goal may refer to."""
    for scene in scenes(task, difficulty):
        stages = task.demonstration(scene)
        assert not any(stage.forbids for stage in stages)
        assert [stage.in_video for stage in stages] == [True] * (len(stages) - 1) + [False]
        assert stages[-1].expects == Fact("home", "robot")
        expected = iter(stage.expects for stage in stages)
        assert all(fact in expected for fact in scene.past)
        for stage in stages:
            if stage.expects.kind == "still":
                assert stage.lasting == stage.primitive.steps > 0
                assert stage.subgoal == "static"


# VideoRepick


def test_a_repick_is_a_pick_and_a_put_down_for_each_repetition_then_a_press():
    scene, _ = drawn(VIDEO_REPICK, "hard")[0]
    target = scene.past[0].subject
    stages = VIDEO_REPICK.stages(scene, Goal.of(repeats=2))
    cycle = [("pick_cube", target), ("put_down", target)]

    assert primitives_of(stages) == [*cycle, *cycle, ("press", "button")]
    assert [stage.primitive.height for stage in stages[1:4:2]] == [0.01, 0.01]
    assert [stage.timer for stage in stages] == ["pick", "put down", "pick", "put down", None]
    assert [stage.subgoal for stage in stages] == [
        "pick up the correct cube {at} for the first time",
        "put it down",
        "pick up the correct cube {at} for the second time",
        "put it down",
        "press the button {at} to finish",
    ]


# VideoPlaceButton and VideoPlaceOrder


@every_place_task
def test_hard_place_scenes_swap_any_two_of_four_discs_while_the_robot_waits(task):
    """12 are all ordered pairs of four discs."""
    pairs = set()
    for scene in scenes(task, "hard"):
        (swap,) = scene.motions
        discs = {disc.name for disc in scene.of_kind("target")}
        assert {swap.first, swap.second, *swap.pinned} == discs
        assert task.demonstration(scene)[swap.stage].primitive.kind == "hold"
        pairs.add((swap.first, swap.second))
    assert len(pairs) == 12


def test_each_goal_of_place_button_moves_a_cube_to_the_disc_before_or_after_the_press():
    """Three colors, each before or after the press: six goals."""
    scene, _ = drawn(VIDEO_PLACE_BUTTON, "hard")[0]
    goals = VIDEO_PLACE_BUTTON.goals(scene)
    assert len(goals) == 6

    for goal in goals:
        cube = f"cube_{goal.text('color')}"
        answer = {"before": "target_0", "after": "target_1"}[goal.text("relation")]
        stages = VIDEO_PLACE_BUTTON.stages(scene, goal)
        assert primitives_of(stages) == [("pick_cube", cube), ("place_on", cube, answer)]


@every_place_task
def test_seeds_without_room_for_all_targets_are_rejected_but_not_too_many(task):
    """About 35 and 75 of 100: few enough for the 30 seeds that an episode may try."""

    def rejected(seed):
        try:
            task.sample(np.random.default_rng(seed), "medium")
        except SceneRejectedError as error:
            return str(error).startswith("no place for target_")
        return False

    # About 35 and 75 of 100: few enough for the 30 seeds that an episode may try.
    assert 4 <= sum(map(rejected, range(40))) <= 35
