"""Goals, stages and subgoals of BinFill, SwingXtimes and StopCube, over many seeds.

Where things stand is compared with RoboMME in `test_sampler_distributions.py`, and pinned in
`test_splits.py`.
"""

import functools
from dataclasses import replace

import numpy as np
import pytest
from drawn_scenes import drawn_scenes

from roboirg.core.conditions import Elapsed, Fact
from roboirg.core.episode import Goal, Primitive
from roboirg.core.errors import SceneRejectedError
from roboirg.core.footprints import Rectangle, Region, overlap
from roboirg.tasks import bin_fill, stop_cube, swing_x_times
from roboirg.tasks.shared.fixtures import draw_bin, footprint

SEEDS = 150


@functools.cache
def scenes(task, difficulty):
    """Return the scenes of the seeds 0 to 149, each with its goal; "hard" has all colors."""
    return list(drawn_scenes(task, difficulty, range(SEEDS)))


def test_a_scene_without_room_for_the_bin_is_rejected():
    """The whole region of 0.1 m is taken by a square of 1 m."""
    with pytest.raises(SceneRejectedError, match="no place for bin"):
        draw_bin(np.random.default_rng(0), Region(0, 0, 0.1, 0.1), [Rectangle(0, 0, 1, 1)])


# BinFill


def test_bin_fill_keeps_the_bin_off_the_button(monkeypatch):
    """In the real regions the two hardly ever meet. Here both are replaced by small ones next to
    each other, in which they would overlap in every second draw, for 50 seeds."""
    monkeypatch.setattr(bin_fill, "BUTTON_REGION", Region(-0.15, 0.0, 0.0, 0.0))
    monkeypatch.setattr(bin_fill, "BIN_REGION", Region(-0.05, 0.0, 0.03, 0.03))
    for seed in range(50):
        scene, _ = bin_fill.sample(np.random.default_rng(seed), "easy")
        assert not overlap(footprint(scene["bin"]), footprint(scene["button"]))


def bin_fill_scene(**numbers):
    """Return a scene with so many cubes of each color, and no order of the colors."""
    drawn, _ = scenes("BinFill", "hard")[0]
    cube = drawn.of_kind("cube")[0]
    objects = [drawn["button"], drawn["bin"]]
    for color, number in numbers.items():
        for index in range(number):
            objects.append(replace(cube, name=f"{color}_{index}", color=color))
    return replace(drawn, objects=tuple(objects), motions=(), color_order=())


def test_bin_fill_has_a_goal_for_each_choice_among_the_cubes_of_the_scene():
    """Colors that are not wanted are left out of a goal."""
    goals = bin_fill.goals(bin_fill_scene(red=2, blue=1))

    assert [goal.amounts for goal in goals] == [
        (("blue", 1),),
        (("red", 1),),
        (("red", 1), ("blue", 1)),
        (("red", 2),),
        (("red", 2), ("blue", 1)),
    ]


def test_bin_fill_wants_at_most_five_cubes():
    """The scene has seven green cubes and no others; there is a goal for each number from one to
    five."""
    goals = bin_fill.goals(bin_fill_scene(green=7))

    assert [goal["counts"] for goal in goals] == [(1,), (2,), (3,), (4,), (5,)]


TWO_RED_ONE_BLUE = Goal.of(colors=("red", "blue"), counts=(2, 1))


def test_bin_fill_subgoals_number_the_cubes_of_each_color_separately():
    """The goal is two red cubes and a blue one. `{at}` stands for the place of the object, which is
    filled in later."""
    stages = bin_fill.stages(bin_fill_scene(red=2, blue=1), TWO_RED_ONE_BLUE)

    assert [stage.subgoal for stage in stages] == [
        "pick up the first red cube {at}",
        "put it into the bin {at}",
        "pick up the second red cube {at}",
        "put it into the bin {at}",
        "pick up the first blue cube {at}",
        "put it into the bin {at}",
        "press the button {at}",
    ]


def test_bin_fill_picks_in_the_order_of_the_scene_if_it_has_one():
    """The goal names two red cubes first, then a blue one; the scene has an order of the colors,
    and blue is first in it."""
    scene = replace(bin_fill_scene(red=2, blue=1), color_order=("blue",))

    stages = bin_fill.stages(scene, TWO_RED_ONE_BLUE)

    assert [stage.subgoal for stage in stages if "pick up" in stage.subgoal] == [
        "pick up the first blue cube {at}",
        "pick up the first red cube {at}",
        "pick up the second red cube {at}",
    ]


# SwingXtimes


def test_swing_goes_over_the_right_and_the_left_target_once_per_repeat():
    """The scene has a cube of each color; the cube is put down from 0.07 m."""
    scene, _ = scenes("SwingXtimes", "hard")[0]

    stages = swing_x_times.stages(scene, Goal.of(color="green", repeats=3))

    assert [stage.primitive for stage in stages] == [
        Primitive("pick_cube", "cube_green"),
        Primitive("move_over", "cube_green", "target_right"),
        Primitive("move_over", "cube_green", "target_left"),
        Primitive("move_over", "cube_green", "target_right"),
        Primitive("move_over", "cube_green", "target_left"),
        Primitive("move_over", "cube_green", "target_right"),
        Primitive("move_over", "cube_green", "target_left"),
        Primitive("put_down", "cube_green", height=0.07),
        Primitive("press", "button"),
    ]


def test_swing_subgoals_number_the_repeats():
    """The red cube is to be swung twice from the right to the left target. `{at}` stands for the
    place of the object, which is filled in later."""
    scene, _ = scenes("SwingXtimes", "hard")[0]

    stages = swing_x_times.stages(scene, Goal.of(color="red", repeats=2))

    assert [stage.subgoal for stage in stages] == [
        "pick up the red cube {at}",
        "move to the top of the right-side target {at} for the first time",
        "move to the top of the left-side target {at} for the first time",
        "move to the top of the right-side target {at} for the second time",
        "move to the top of the left-side target {at} for the second time",
        "put the red cube on the table",
        "press the button {at}",
    ]


# StopCube


def test_stop_cube_ignores_the_difficulty():
    """The same 150 seeds give the same scenes and goals at each difficulty."""
    assert scenes("StopCube", "easy") == scenes("StopCube", "medium") == scenes("StopCube", "hard")


@pytest.mark.parametrize(
    ("interval", "visit", "expected"),
    [
        (60, 2, (60,)),
        (80, 2, (90,)),
        (60, 5, (100, 200, 240)),
        (120, 4, (100, 200, 300, 390)),
        (120, 5, (100, 200, 300, 400, 500, 510)),
    ],
)
def test_stop_cube_waits_in_steps_of_100_until_30_steps_before_the_visit(interval, visit, expected):
    """The middle of a visit is at interval × (visit − ½); the last number is 30 steps before."""
    assert stop_cube.checkpoints(interval, visit) == expected


def stages_of_the_third_visit():
    """Return the stages for passes of 120 steps: the visit takes steps 240 to 360."""
    scene, _ = scenes("StopCube", "easy")[0]
    (shuttle,) = scene.motions
    scene = replace(scene, motions=(shuttle._replace(interval=120),))
    return stop_cube.stages(scene, Goal.of(visit=3))


def test_stop_cube_hovers_waits_and_presses_in_the_middle_of_the_visit():
    """A pass takes 120 steps, so the third visit is from step 240 to 360, with its middle at 300.
    Waiting goes on in steps of 100 until 30 steps before that."""
    stages = stages_of_the_third_visit()

    assert [stage.primitive for stage in stages] == [
        Primitive("hover", "button"),
        Primitive("hold_until", "robot", steps=100),
        Primitive("hold_until", "robot", steps=200),
        Primitive("hold_until", "robot", steps=270),
        Primitive("press_below", "button", steps=300),
    ]


def test_stop_cube_stages_end_over_the_button_then_by_time_then_with_the_cube_on_the_target():
    """The third visit takes the steps 240 to 360, so it is time to press 30 steps before its
    middle, at 270; before that there is a stage for each 100 steps."""
    stages = stages_of_the_third_visit()

    assert [stage.expects for stage in stages] == [
        Fact("hovering", "robot", "button"),
        Elapsed(least=100),
        Elapsed(least=200),
        Elapsed(least=270),
        Fact("stopped", "shuttle", "target"),
    ]


def test_stop_cube_points_at_the_target_when_it_is_time_to_press():
    """The last stage is to press the button when the cube is on its target, which is what has to be
    looked at, and not the button."""
    assert stages_of_the_third_visit()[-1].points_at == "target"
