"""Goals, stages and subgoals of BinFill, SwingXtimes and StopCube, over many seeds.

Where things stand is compared with RoboMME in `test_sampler_distributions.py`, and pinned in
`test_splits.py`.
"""

import functools
import itertools
from dataclasses import replace

import numpy as np
import pytest
from drawn_scenes import drawn_scenes

from roboirg.core.conditions import Elapsed
from roboirg.core.episode import DIFFICULTIES
from roboirg.core.errors import SceneRejectedError
from roboirg.core.footprints import Rectangle, Region, overlap
from roboirg.tasks import bin_fill, stop_cube, swing_x_times
from roboirg.tasks.shared.fixtures import (
    draw_bin,
    footprint,
)

SEEDS = 150


@functools.cache
def scenes(task, difficulty):
    return list(drawn_scenes(task, difficulty, range(SEEDS)))


def cubes_of_color(scene, color):
    return [cube for cube in scene.of_kind("cube") if cube.color == color]


each_difficulty = pytest.mark.parametrize("difficulty", DIFFICULTIES)


def test_a_scene_without_room_for_the_bin_is_rejected():
    """The whole region of 0.1 m is taken by a square of 1 m."""
    with pytest.raises(SceneRejectedError, match="no place for bin"):
        draw_bin(np.random.default_rng(0), Region(0, 0, 0.1, 0.1), [Rectangle(0, 0, 1, 1)])


# BinFill


def test_bin_fill_keeps_the_bin_off_the_button(monkeypatch):
    """In the real regions the two hardly ever meet; here they would in every second draw."""
    # In the real regions the two hardly ever meet; here they would in every second draw.
    monkeypatch.setattr(bin_fill, "BUTTON_REGION", Region(-0.15, 0.0, 0.0, 0.0))
    monkeypatch.setattr(bin_fill, "BIN_REGION", Region(-0.05, 0.0, 0.03, 0.03))
    for seed in range(50):
        scene, _ = bin_fill.sample(np.random.default_rng(seed), "easy")
        assert not overlap(footprint(scene["bin"]), footprint(scene["button"]))


def test_bin_fill_has_a_goal_for_each_choice_of_one_to_five_cubes():
    scene, _ = scenes("BinFill", "hard")[0]
    there = {c: len(cubes_of_color(scene, c)) for c in ("red", "blue", "green")}

    possible = [
        counts
        for counts in itertools.product(*(range(number + 1) for number in there.values()))
        if 1 <= sum(counts) <= 5
    ]

    assert len(bin_fill.goals(scene)) == len(possible)
    assert all(min(goal.numbers("counts")) >= 1 for goal in bin_fill.goals(scene))


def test_bin_fill_subgoals_number_the_cubes_of_each_color_separately():
    """The order of the colors is that of the goal, unless the scene has an order of its own."""
    scene, _ = scenes("BinFill", "hard")[0]
    goal = next(g for g in bin_fill.goals(scene) if g.numbers("counts") == (2, 1))
    first, second = goal.texts("colors")
    scene = replace(scene, color_order=())  # the goal's

    assert [stage.subgoal for stage in bin_fill.stages(scene, goal)] == [
        f"pick up the first {first} cube {{at}}",
        "put it into the bin {at}",
        f"pick up the second {first} cube {{at}}",
        "put it into the bin {at}",
        f"pick up the first {second} cube {{at}}",
        "put it into the bin {at}",
        "press the button {at}",
    ]

    # The scene's own order takes the second color first.
    turned = bin_fill.stages(replace(scene, color_order=(second,)), goal)
    assert [stage.subgoal for stage in turned[::2]] == [
        f"pick up the first {second} cube {{at}}",
        f"pick up the first {first} cube {{at}}",
        f"pick up the second {first} cube {{at}}",
        "press the button {at}",
    ]


# SwingXtimes


@each_difficulty
def test_swing_stages_go_right_then_left_with_the_goals_cube(difficulty):
    """A pick, both sides for each repetition, a put-down and a press: 2 × repeats + 3 stages."""
    for scene, _ in scenes("SwingXtimes", difficulty)[:50]:
        for goal in swing_x_times.TASK.goals(scene):
            stages = swing_x_times.stages(scene, goal)
            repeats = goal.number("repeats")
            assert len(stages) == 2 * repeats + 3
            assert {stage.primitive.subject for stage in stages[:-1]} == {
                f"cube_{goal.text('color')}"
            }
            sides = [stage.primitive.place for stage in stages[1:-2]]
            assert sides == ["target_right", "target_left"] * repeats
            assert stages[-2].primitive.height == 0.07
            kinds = [stages[n].primitive.kind for n in (0, -2, -1)]
            assert kinds == ["pick_cube", "put_down", "press"]


def test_swing_subgoals_number_the_repetitions():
    scene, _ = scenes("SwingXtimes", "easy")[0]
    goal = swing_x_times.TASK.goals(scene)[1]

    color = goal.text("color")

    assert [stage.subgoal for stage in swing_x_times.stages(scene, goal)] == [
        f"pick up the {color} cube {{at}}",
        "move to the top of the right-side target {at} for the first time",
        "move to the top of the left-side target {at} for the first time",
        "move to the top of the right-side target {at} for the second time",
        "move to the top of the left-side target {at} for the second time",
        f"put the {color} cube on the table",
        "press the button {at}",
    ]


# StopCube


def test_stop_cube_ignores_the_difficulty():
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


def test_stop_cube_stages_hover_wait_and_press():
    """The hand goes over the button, waits until it is time, and presses."""
    for scene, _ in scenes("StopCube", "easy")[:50]:
        (run,) = scene.motions
        for goal in stop_cube.goals(scene):
            hover, *waits, press = stop_cube.stages(scene, goal)
            times = stop_cube.checkpoints(run.interval, goal.number("visit"))
            assert hover.primitive.kind == "hover"
            assert [stage.expects for stage in waits] == [Elapsed(least=time) for time in times]
            assert [stage.primitive.steps for stage in waits] == list(times)
            assert press.primitive.kind == "press_below"
            assert press.points_at == "target"
            middle = run.interval * (goal.number("visit") - 0.5)
            assert times[-1] == middle - 30
