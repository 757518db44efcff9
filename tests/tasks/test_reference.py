"""Videos and plans of the three Reference tasks.

Where things stand is compared with RoboMME in `test_sampler_distributions.py`, and pinned in
`test_splits.py`.
"""

import functools
import itertools

import pytest
from drawn_scenes import drawn_scenes

from roboirg.core.conditions import Fact
from roboirg.core.episode import DIFFICULTIES, Goal, Primitive
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


@every_task
@every_difficulty
def test_a_video_shows_the_facts_of_the_past_in_order_and_can_never_fail(task, difficulty):
    """The past of a scene is what the video shows, and what a goal may refer to. The stages of the
    video expect these facts in the same order, and forbid nothing."""
    for scene in scenes(task, difficulty):
        stages = task.demonstration(scene)

        shown = [stage.expects for stage in stages if stage.expects in scene.past]
        assert shown == list(scene.past)
        assert not any(stage.forbids for stage in stages)


@every_task
def test_the_last_stage_of_a_video_takes_the_robot_home_and_is_not_shown(task):
    """In the scenes of 120 seeds; all stages before the last one are shown."""
    for scene in scenes(task, "hard"):
        *shown, last = task.demonstration(scene)

        assert last.expects == Fact("home", "robot")
        assert not last.in_video
        assert all(stage.in_video for stage in shown)


@every_task
def test_in_the_stages_of_a_video_in_which_the_robot_is_still_it_is_called_static(task):
    """Such a stage expects the fact that the robot is still, for as many steps as it holds still.
    Its subgoal in words is RoboMME's, "static"."""
    for scene in scenes(task, "hard"):
        for stage in task.demonstration(scene):
            if stage.expects.kind == "still":
                assert stage.lasting == stage.primitive.steps > 0
                assert stage.subgoal == "static"


# VideoRepick


def test_a_repick_is_a_pick_and_a_put_down_for_each_repetition_then_a_press():
    """It is put down from 1 cm above the table."""
    scene, _ = drawn(VIDEO_REPICK, "hard")[0]
    cube = scene.past[0].subject

    stages = VIDEO_REPICK.stages(scene, Goal.of(repeats=2))

    assert [stage.primitive for stage in stages] == [
        Primitive("pick_cube", cube),
        Primitive("put_down", cube, height=0.01),
        Primitive("pick_cube", cube),
        Primitive("put_down", cube, height=0.01),
        Primitive("press", "button"),
    ]


def test_the_subgoals_and_timers_of_a_repick():
    """A timer decides when a press is too early."""
    scene, _ = drawn(VIDEO_REPICK, "hard")[0]

    stages = VIDEO_REPICK.stages(scene, Goal.of(repeats=2))

    assert [(stage.subgoal, stage.timer) for stage in stages] == [
        ("pick up the correct cube {at} for the first time", "pick"),
        ("put it down", "put down"),
        ("pick up the correct cube {at} for the second time", "pick"),
        ("put it down", "put down"),
        ("press the button {at} to finish", None),
    ]


# VideoPlaceButton and VideoPlaceOrder


@every_place_task
def test_hard_place_scenes_swap_two_of_four_discs_while_the_robot_waits(task):
    """In a hard scene one motion is scripted: two discs change places, and the others are pinned,
    so that nothing pushes them. It happens in a stage of the video in which the robot holds
    still."""
    for scene in scenes(task, "hard"):
        (swap,) = scene.motions

        discs = {disc.name for disc in scene.of_kind("target")}
        assert len(discs) == 4
        assert {swap.first, swap.second, *swap.pinned} == discs
        assert task.demonstration(scene)[swap.stage].primitive.kind == "hold"


@every_place_task
def test_any_two_discs_of_hard_place_scenes_may_swap_in_either_order(task):
    """In a hard scene one motion is scripted: two of four discs change places. The scenes of 120
    seeds have all ordered pairs of discs, 4 * 3 of them."""
    pairs = set()
    for scene in scenes(task, "hard"):
        (swap,) = scene.motions
        pairs.add((swap.first, swap.second))

    assert len(pairs) == 4 * 3


def test_place_button_has_a_goal_for_each_color_before_and_after_the_press():
    """The scene has a red, a green and a blue cube. The video shows a placement before and one
    after a press, to either of which a goal may refer."""
    scene, _ = drawn(VIDEO_PLACE_BUTTON, "hard")[0]

    goals = VIDEO_PLACE_BUTTON.goals(scene)

    assert {(goal.text("color"), goal.text("relation")) for goal in goals} == {
        ("red", "before"),
        ("red", "after"),
        ("green", "before"),
        ("green", "after"),
        ("blue", "before"),
        ("blue", "after"),
    }


@pytest.mark.parametrize(("relation", "disc"), [("before", "target_0"), ("after", "target_1")])
def test_place_button_moves_a_cube_to_the_disc_before_or_after_the_press(relation, disc):
    """In this scene's video the placement before the press is on target_0, and the one after it on
    target_1."""
    scene, _ = drawn(VIDEO_PLACE_BUTTON, "hard")[0]

    stages = VIDEO_PLACE_BUTTON.stages(scene, Goal.of(color="red", relation=relation))

    assert [stage.primitive for stage in stages] == [
        Primitive("pick_cube", "cube_red"),
        Primitive("place_on", "cube_red", disc),
    ]
