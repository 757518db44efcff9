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
from roboirg.tasks.shared.real_table import draw_regions, draw_tape, left_to_right

REAL = ("PutInBox", "PickByCount")
MODULES = {"PutInBox": put_in_box, "PickByCount": pick_by_count}
PAIRS = {"PutInBox": ("box", {"green", "purple"}), "PickByCount": ("tape", {"yellow", "gray"})}
SEEDS = 200

each_task = pytest.mark.parametrize("task", REAL)


@functools.cache
def scenes(task):
    return [MODULES[task].sample(np.random.default_rng(seed), "easy") for seed in range(SEEDS)]


def test_the_benchmark_is_eleven_tasks_and_the_real_ones_are_beside_it():
    assert tuple(all_tasks(("real",))) == REAL
    assert tuple(every_task()) == (*all_tasks(), *REAL)
    assert {task.suite for task in all_tasks().values()} == set(BENCHMARK_SUITES)


def test_tasks_are_meant_by_name_by_suite_or_all_together():
    assert find_tasks(["all"]) == tuple(all_tasks())
    assert find_tasks(["StopCube", "real", "PickByCount"]) == ("StopCube", *REAL)
    assert find_tasks(["PickByCount", "All"]) == (*all_tasks(), "PickByCount")
    assert set(find_tasks(SUITES)) == set(every_task())
    for wrong in ("PutInBoxx", "realy"):
        with pytest.raises(UnknownNameError, match=rf"no task '{wrong}'.*Did you mean"):
            find_tasks(["all", wrong])


@each_task
def test_difficulties_do_not_differ(task):
    for seed in range(20):
        drawn = {
            MODULES[task].sample(np.random.default_rng(seed), difficulty)
            for difficulty in DIFFICULTIES
        }
        assert len(drawn) == 1


@each_task
def test_one_of_the_pair_is_on_the_robot_s_left_and_one_on_its_right(task):
    kind, colors = PAIRS[task]
    for scene, _ in scenes(task):
        left, right = sorted(scene.of_kind(kind), key=lambda item: -item.position.y)
        assert left.position.y > 0.05 > -0.05 > right.position.y
        assert left_to_right(scene, kind) == (left.color, right.color)
        assert {left.color, right.color} == colors


@each_task
def test_every_goal_is_as_likely_on_either_side(task):
    kind, _ = PAIRS[task]

    counts = Counter()
    for scene, goal in scenes(task):
        side = left_to_right(scene, kind).index(goal.text("color"))
        counts[goal, side] += 1

    goals = get_task(task).goals(scenes(task)[0][0])
    assert len(counts) == 2 * len(goals)
    expected = SEEDS / len(counts)
    assert all(abs(count - expected) <= 5 * expected**0.5 for count in counts.values())


def test_regions_are_mirrored():
    left = Region(0.1, 0.2, 0.01, 0.02)
    right = Region(0.1, -0.2, 0.01, 0.02)

    regions = draw_regions(np.random.default_rng(0), ("yellow", "gray"), left)

    assert set(regions) == {"yellow", "gray"}
    assert set(regions.values()) == {left, right}


def test_a_tape_without_a_place_rejects_the_seed():
    region = Region(0, 0, 0.1, 0.1)
    full = [Rectangle(0, 0, 1, 1)]
    with pytest.raises(SceneRejectedError, match="no place for tape"):
        draw_tape(np.random.default_rng(0), "tape", "yellow", region, 0.0, full)


def judged(task, goal, *steps):
    scene, _ = scenes(task)[0]
    return staged.judged(get_task(task).stages(scene, goal), scene, *steps)


def test_the_tape_belongs_into_the_one_box():
    picked = Fact("picked", "tape")
    inside = {color: Fact("binned", "tape", f"box_{color}") for color in ("green", "purple")}
    goal = Goal.of(color="green")
    # Dropped beside the boxes, it may be picked up again.
    dropped = ([picked], [], [Fact("lying", "tape")], [picked], [])

    assert judged("PutInBox", goal, *dropped).status is Status.ONGOING
    assert judged("PutInBox", goal, *dropped, [inside["green"]]).status is Status.SUCCESS

    wrong = judged("PutInBox", goal, [picked], [], [inside["purple"]])
    assert wrong.status is Status.FAILURE
    assert (
        wrong.cause == "put the tape into the purple box; expected: put the tape into the green box"
    )
    assert judged("PutInBox", goal, [inside["purple"]]).status is Status.FAILURE


PICKED = Fact("picked", "tape_gray")
PLACED = Fact("placed", "tape_gray", "target")
CYCLE = ([PICKED], [], [PLACED])
OTHER = Fact("picked", "tape_yellow")


def waiting(steps):
    return [[PLACED]] * steps


@pytest.mark.parametrize("repeats", [1, 2])
def test_as_often_as_wanted_and_then_no_more(repeats):
    goal = Goal.of(color="gray", repeats=repeats)

    def after(*steps):
        return judged("PickByCount", goal, *CYCLE * repeats, *steps)

    # The last placement is evaluation 3 N - 1; the wait begins with the next.
    assert after(*waiting(WAIT_STEPS)).status is Status.ONGOING
    assert after(*waiting(WAIT_STEPS + 1)).status is Status.SUCCESS

    again = after(*waiting(WAIT_STEPS - 1), [PICKED])
    assert again.status is Status.FAILURE
    assert again.cause.startswith("picked up the gray tape again; expected: leave the tapes")
    assert after([OTHER]).status is Status.FAILURE


def test_too_few_is_no_success_however_long_one_waits():
    goal = Goal.of(color="gray", repeats=2)
    judge = judged("PickByCount", goal, *CYCLE, *waiting(3 * WAIT_STEPS))
    assert (judge.status, judge.index) == (Status.ONGOING, 2)


def test_the_other_tape_is_not_to_be_picked():
    goal = Goal.of(color="gray", repeats=1)
    assert judged("PickByCount", goal, [OTHER]).cause.startswith("picked up the yellow tape; ")
    assert judged("PickByCount", goal, [PICKED], [OTHER]).status is Status.FAILURE

    # Beside the target, and once more.
    beside = ([PICKED], [Fact("lying", "tape_gray")], *CYCLE, *waiting(WAIT_STEPS + 1))
    assert judged("PickByCount", goal, *beside).status is Status.SUCCESS
