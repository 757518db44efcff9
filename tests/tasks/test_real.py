"""The tasks of the real robot: beside the benchmark, what their scenes hold, and their rules."""

import functools
from collections import Counter

import numpy as np
import pytest
import staged

from roboirg.core.conditions import Fact
from roboirg.core.episode import BENCHMARK_SUITES, SUITES, Goal
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


@pytest.mark.parametrize(
    ("names", "tasks"),
    [
        (["all"], (*all_tasks(),)),
        (["StopCube", "real", "PickByCount"], ("StopCube", "PutInBox", "PickByCount")),
        (["PickByCount", "All"], (*all_tasks(), "PickByCount")),
        (SUITES, (*every_task(),)),
    ],
)
def test_tasks_are_selected_by_name_by_suite_or_with_all(names, tasks):
    """A suite is a group of tasks, such as "real"; *all* are those of the benchmark."""
    assert find_tasks(names) == tasks


@pytest.mark.parametrize("wrong", ["PutInBoxx", "realy"])
def test_an_unknown_task_or_suite_is_refused_with_the_nearest_name(wrong):
    with pytest.raises(UnknownNameError, match=rf"no task '{wrong}'.*Did you mean"):
        find_tasks(["all", wrong])


@each_task
@pytest.mark.parametrize("difficulty", ["medium", "hard"])
def test_real_tasks_have_the_same_scenes_at_every_difficulty(task, difficulty):
    for seed in range(20):
        scene_and_goal = MODULES[task].sample(np.random.default_rng(seed), difficulty)

        assert scene_and_goal == scenes(task)[seed]


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
    goals = get_task(task).goals(scenes(task)[0][0])

    counts = Counter()
    for scene, goal in scenes(task):
        side = left_to_right(scene, kind).index(goal.text("color"))
        counts[goal, side] += 1

    mean = SEEDS / (2 * len(goals))
    assert len(counts) == 2 * len(goals)
    assert max(counts.values()) <= mean + 5 * mean**0.5
    assert min(counts.values()) >= mean - 5 * mean**0.5


def test_the_region_on_the_right_mirrors_the_one_on_the_left():
    """Regions are (x, y, half width, half depth), and y is positive on the robot's left. One color
    gets the given region, and the other one the same with -y."""
    left = Region(0.1, 0.2, 0.01, 0.02)
    right = Region(0.1, -0.2, 0.01, 0.02)

    regions = draw_regions(np.random.default_rng(0), ("yellow", "gray"), left)

    assert set(regions) == {"yellow", "gray"}
    assert set(regions.values()) == {left, right}


def test_a_scene_without_room_for_the_tape_is_rejected():
    """A square of 2 m takes up the whole table."""
    full = [Rectangle(0, 0, 1, 1)]
    with pytest.raises(SceneRejectedError, match="no place for tape"):
        draw_item(np.random.default_rng(0), put_in_box.TAPE_PLAN, full)


def judged_in_first_scene(task, goal, *steps):
    scene, _ = scenes(task)[0]
    return staged.judged(get_task(task).stages(scene, goal), scene, *steps)


TAPE_PICKED = Fact("picked", "tape")
IN_GREEN = Fact("binned", "tape", "box_green")
IN_PURPLE = Fact("binned", "tape", "box_purple")


def judged_with_green_box(*steps):
    """Return the judge after steps with these facts; the tape is to go into the green box."""
    return judged_in_first_scene("PutInBox", Goal.of(color="green"), *steps)


def test_the_tape_in_the_box_of_the_goal_s_color_is_a_success():
    """The goal is the green box; each list has the facts of one step: picked up, in the air, in the
    box."""
    assert judged_with_green_box([TAPE_PICKED], [], [IN_GREEN]).status is Status.SUCCESS


def test_tape_dropped_beside_the_boxes_may_be_picked_up_again():
    """The tape is to go into the green box. Each list has the facts of one step: it falls on the
    table and is picked up again."""
    dropped = [[TAPE_PICKED], [], [Fact("lying", "tape")], [TAPE_PICKED], []]

    assert judged_with_green_box(*dropped).status is Status.ONGOING
    assert judged_with_green_box(*dropped, [IN_GREEN]).status is Status.SUCCESS


def test_the_tape_has_to_go_into_the_box_of_the_goal_s_color():
    """The goal is the green box; each list has the facts of one step, and the last one is that the
    tape is in the purple box."""
    judge = judged_with_green_box([TAPE_PICKED], [], [IN_PURPLE])

    cause = "put the tape into the purple box; expected: put the tape into the green box"
    assert (judge.status, judge.cause) == (Status.FAILURE, cause)


def test_tape_in_the_wrong_box_fails_before_it_was_seen_picked_up():
    """The goal is the green box. In the first step the tape is already in the purple one."""
    assert judged_with_green_box([IN_PURPLE]).status is Status.FAILURE


GRAY_PICKED = Fact("picked", "tape_gray")
GRAY_PLACED = Fact("placed", "tape_gray", "target")
PICK_AND_PLACE_ONCE = ([GRAY_PICKED], [], [GRAY_PLACED])


def waiting(steps):
    return [[GRAY_PLACED]] * steps


def judged_with_gray_tape(repeats, *steps):
    """Return the judge after steps with these facts.

    The gray tape is to be placed on the target so many times, and the tapes then left alone.
    """
    goal = Goal.of(color="gray", repeats=repeats)
    return judged_in_first_scene("PickByCount", goal, *steps)


@pytest.mark.parametrize("repeats", [1, 2])
def test_pick_by_count_succeeds_if_the_tape_is_left_alone_after_the_last_placement(repeats):
    """The wait begins in the step after the last placement."""
    placed = PICK_AND_PLACE_ONCE * repeats

    waits = judged_with_gray_tape(repeats, *placed, *waiting(WAIT_STEPS))
    done = judged_with_gray_tape(repeats, *placed, *waiting(WAIT_STEPS + 1))

    assert waits.status is Status.ONGOING
    assert done.status is Status.SUCCESS


def test_pick_by_count_fails_if_the_tape_is_picked_up_again_during_the_wait():
    """The gray tape is to be placed once and left alone for WAIT_STEPS. It is picked up a step
    before that time is over."""
    steps = [*PICK_AND_PLACE_ONCE, *waiting(WAIT_STEPS - 1), [GRAY_PICKED]]

    judge = judged_with_gray_tape(1, *steps)

    assert judge.status is Status.FAILURE
    assert judge.cause.startswith("picked up the gray tape again; expected: leave the tapes")


def test_pick_by_count_does_not_succeed_after_fewer_placements_than_wanted():
    """The gray tape is to be placed twice. After one placement nothing happens for three times the
    wait: the third stage, of index 2, to pick it up again, stays due."""
    judge = judged_with_gray_tape(2, *PICK_AND_PLACE_ONCE, *waiting(3 * WAIT_STEPS))

    assert (judge.status, judge.index) == (Status.ONGOING, 2)


@pytest.mark.parametrize(
    "before", [[], [[GRAY_PICKED]], PICK_AND_PLACE_ONCE], ids=["at first", "held", "placed"]
)
def test_pick_by_count_fails_if_the_yellow_tape_is_picked_instead_of_the_gray(before):
    """The gray tape is to be placed once; `before` has the facts of the steps before the wrong
    pick: none, while the gray one is held, or after it was placed."""
    judge = judged_with_gray_tape(1, *before, [Fact("picked", "tape_yellow")])

    assert judge.status is Status.FAILURE
    assert judge.cause.startswith("picked up the yellow tape; ")


def test_tape_dropped_beside_the_target_may_be_placed_again():
    """The gray tape is to be placed once. It first falls beside the target; then it is picked up,
    placed and left alone for the wait."""
    beside = [[GRAY_PICKED], [Fact("lying", "tape_gray")]]

    judge = judged_with_gray_tape(1, *beside, *PICK_AND_PLACE_ONCE, *waiting(WAIT_STEPS + 1))

    assert judge.status is Status.SUCCESS
