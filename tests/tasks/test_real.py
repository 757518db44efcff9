"""The tasks of the real robot: beside the benchmark, what their scenes hold, and their rules."""

import functools
from collections import Counter

import numpy as np
import pytest
import staged

from roboirg.core.conditions import Fact
from roboirg.core.episode import BENCHMARK_SUITES, DIFFICULTIES, SUITES, Goal
from roboirg.core.errors import SceneRejectedError, UnknownNameError
from roboirg.core.footprints import Rectangle, Region
from roboirg.judging import Status
from roboirg.tasks import all_tasks, every_task, find_tasks, get_task, pick_by_count, put_in_box
from roboirg.tasks.pick_by_count import WAIT_STEPS
from roboirg.tasks.shared.fixtures import draw_item
from roboirg.tasks.shared.real_table import draw_regions, left_to_right

REAL = ("PutInBox", "PickByCount")
MODULES = {"PutInBox": put_in_box, "PickByCount": pick_by_count}
PAIRS = {"PutInBox": ("box", {"green", "purple"}), "PickByCount": ("tape", {"yellow", "gray"})}
SEEDS = 200

each_task = pytest.mark.parametrize("task", REAL)


@functools.cache
def scenes(task):
    return [MODULES[task].sample(np.random.default_rng(seed), "easy") for seed in range(SEEDS)]


def test_the_two_tasks_of_the_real_robot_are_not_part_of_the_benchmark():
    assert tuple(all_tasks(("real",))) == REAL
    assert tuple(every_task()) == (*all_tasks(), *REAL)
    assert {task.suite for task in all_tasks().values()} == set(BENCHMARK_SUITES)


def test_tasks_are_selected_by_name_by_suite_or_with_all():
    """A suite is a group of tasks, such as "real"."""
    assert find_tasks(["all"]) == tuple(all_tasks())
    assert find_tasks(["StopCube", "real", "PickByCount"]) == ("StopCube", *REAL)
    assert find_tasks(["PickByCount", "All"]) == (*all_tasks(), "PickByCount")
    assert set(find_tasks(SUITES)) == set(every_task())
    for wrong in ("PutInBoxx", "realy"):
        with pytest.raises(UnknownNameError, match=rf"no task '{wrong}'.*Did you mean"):
            find_tasks(["all", wrong])


@each_task
def test_real_tasks_have_the_same_scenes_at_every_difficulty(task):
    for seed in range(20):
        drawn = {
            MODULES[task].sample(np.random.default_rng(seed), difficulty)
            for difficulty in DIFFICULTIES
        }
        assert len(drawn) == 1


@each_task
def test_one_of_the_pair_is_on_the_robot_s_left_and_one_on_its_right(task):
    """The pair is two boxes or two tapes; the robot's left is positive y."""
    kind, colors = PAIRS[task]
    for scene, _ in scenes(task):
        left, right = sorted(scene.of_kind(kind), key=lambda item: -item.position.y)
        assert left.position.y > 0.05 > -0.05 > right.position.y
        assert left_to_right(scene, kind) == (left.color, right.color)
        assert {left.color, right.color} == colors


@each_task
def test_each_goal_is_equally_frequent_on_the_left_and_on_the_right(task):
    """A count may be five standard deviations away from the mean."""
    kind, _ = PAIRS[task]

    counts = Counter()
    for scene, goal in scenes(task):
        side = left_to_right(scene, kind).index(goal.text("color"))
        counts[goal, side] += 1

    goals = get_task(task).goals(scenes(task)[0][0])
    assert len(counts) == 2 * len(goals)
    expected = SEEDS / len(counts)
    assert all(abs(count - expected) <= 5 * expected**0.5 for count in counts.values())


def test_the_region_on_the_right_mirrors_the_one_on_the_left():
    left = Region(0.1, 0.2, 0.01, 0.02)
    right = Region(0.1, -0.2, 0.01, 0.02)

    regions = draw_regions(np.random.default_rng(0), ("yellow", "gray"), left)

    assert set(regions) == {"yellow", "gray"}
    assert set(regions.values()) == {left, right}


def test_a_scene_without_room_for_the_tape_is_rejected():
    full = [Rectangle(0, 0, 1, 1)]
    with pytest.raises(SceneRejectedError, match="no place for tape"):
        draw_item(np.random.default_rng(0), put_in_box.TAPE_PLAN, full)


def judged_in_first_scene(task, goal, *steps):
    scene, _ = scenes(task)[0]
    return staged.judged(get_task(task).stages(scene, goal), scene, *steps)


def test_the_tape_has_to_go_into_the_box_of_the_goal_s_color():
    picked = Fact("picked", "tape")
    inside = {color: Fact("binned", "tape", f"box_{color}") for color in ("green", "purple")}
    goal = Goal.of(color="green")
    # Dropped beside the boxes, it may be picked up again.
    dropped = ([picked], [], [Fact("lying", "tape")], [picked], [])

    assert judged_in_first_scene("PutInBox", goal, *dropped).status is Status.ONGOING
    assert (
        judged_in_first_scene("PutInBox", goal, *dropped, [inside["green"]]).status
        is Status.SUCCESS
    )

    wrong = judged_in_first_scene("PutInBox", goal, [picked], [], [inside["purple"]])
    assert wrong.status is Status.FAILURE
    assert (
        wrong.cause == "put the tape into the purple box; expected: put the tape into the green box"
    )
    assert judged_in_first_scene("PutInBox", goal, [inside["purple"]]).status is Status.FAILURE


GRAY_PICKED = Fact("picked", "tape_gray")
GRAY_PLACED = Fact("placed", "tape_gray", "target")
PICK_AND_PLACE_ONCE = ([GRAY_PICKED], [], [GRAY_PLACED])
WRONG_TAPE_PICKED = Fact("picked", "tape_yellow")


def waiting(steps):
    return [[GRAY_PLACED]] * steps


@pytest.mark.parametrize("repeats", [1, 2])
def test_pick_by_count_succeeds_if_the_tape_is_left_alone_after_the_last_placement(repeats):
    """The goal is to move the gray tape to the target `repeats` times and then to wait."""
    goal = Goal.of(color="gray", repeats=repeats)

    def after(*steps):
        return judged_in_first_scene("PickByCount", goal, *PICK_AND_PLACE_ONCE * repeats, *steps)

    # The last placement is evaluation 3 N - 1; the wait begins with the next.
    assert after(*waiting(WAIT_STEPS)).status is Status.ONGOING
    assert after(*waiting(WAIT_STEPS + 1)).status is Status.SUCCESS

    again = after(*waiting(WAIT_STEPS - 1), [GRAY_PICKED])
    assert again.status is Status.FAILURE
    assert again.cause.startswith("picked up the gray tape again; expected: leave the tapes")
    assert after([WRONG_TAPE_PICKED]).status is Status.FAILURE


def test_pick_by_count_does_not_succeed_after_fewer_placements_than_wanted():
    """Two are wanted and one is done; the third of its stages stays due."""
    goal = Goal.of(color="gray", repeats=2)
    judge = judged_in_first_scene(
        "PickByCount", goal, *PICK_AND_PLACE_ONCE, *waiting(3 * WAIT_STEPS)
    )
    assert (judge.status, judge.index) == (Status.ONGOING, 2)


def test_pick_by_count_fails_if_the_yellow_tape_is_picked_instead_of_the_gray():
    goal = Goal.of(color="gray", repeats=1)
    assert judged_in_first_scene("PickByCount", goal, [WRONG_TAPE_PICKED]).cause.startswith(
        "picked up the yellow tape; "
    )
    assert (
        judged_in_first_scene("PickByCount", goal, [GRAY_PICKED], [WRONG_TAPE_PICKED]).status
        is Status.FAILURE
    )

    # Beside the target, and once more.
    beside = (
        [GRAY_PICKED],
        [Fact("lying", "tape_gray")],
        *PICK_AND_PLACE_ONCE,
        *waiting(WAIT_STEPS + 1),
    )
    assert judged_in_first_scene("PickByCount", goal, *beside).status is Status.SUCCESS
