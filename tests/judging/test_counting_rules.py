"""What BinFill, SwingXtimes and StopCube reward and punish, driven by synthetic facts."""

import pytest
from drawn_scenes import drawn_scenes
from staged import judged

from roboirg.core.conditions import Fact
from roboirg.core.episode import Goal
from roboirg.core.motions import Shuttle
from roboirg.judging import Judge, Status
from roboirg.tasks import bin_fill, stop_cube, swing_x_times

PRESSED = Fact("pressed", "button")


def scene_of(task, suits):
    """The first scene of a hard episode for which a test holds."""
    return next(scene for scene, _ in drawn_scenes(task.TASK.name, "hard") if suits(scene))


# BinFill: two red cubes and a blue one; there are green ones, too.


def color_numbers(scene):
    colors = [cube.color for cube in scene.of_kind("cube")]
    return [colors.count(color) for color in ("red", "blue", "green")]


FILL_SCENE = scene_of(bin_fill, lambda scene: min(color_numbers(scene)) >= 3)
FILL = bin_fill.stages(FILL_SCENE, Goal.of(colors=("red", "blue"), counts=(2, 1)))


def picked(cube):
    return Fact("picked", cube)


def fill(*cubes):
    """Facts of picking each cube and dropping it into the bin, where it counts for ever."""
    inside = []
    for cube in cubes:
        yield [picked(cube), *inside]
        yield list(inside)
        inside.append(Fact("binned", cube, "bin"))
        yield list(inside)


def filled(*cubes, then=()):
    inside = [Fact("binned", cube, "bin") for cube in cubes]
    return judged(FILL, FILL_SCENE, *fill(*cubes), *([*inside, *facts] for facts in then))


@pytest.mark.parametrize(
    "cubes",
    [
        ("cube_red_0", "cube_red_1", "cube_blue_0"),
        ("cube_blue_0", "cube_red_1", "cube_red_0"),
        ("cube_red_2", "cube_blue_2", "cube_red_0"),
    ],
    ids=["as planned", "other order", "other cubes"],
)
def test_bin_fill_accepts_any_order_and_any_cubes_of_the_colors(cubes):
    assert filled(*cubes, then=[[]]).status is Status.ONGOING
    assert filled(*cubes, then=[[], [PRESSED]]).status is Status.SUCCESS
    assert filled(*cubes, then=[[PRESSED]]).status is Status.SUCCESS


def test_bin_fill_punishes_a_press_before_the_last_drop():
    assert filled(then=[[PRESSED]]).status is Status.FAILURE
    for cubes in (("cube_red_0",), ("cube_red_0", "cube_red_1")):
        judge = filled(*cubes, then=[[PRESSED]])
        assert judge.status is Status.FAILURE
        assert judge.cause.startswith("pressed the button; expected: pick up the")


@pytest.mark.parametrize(
    ("cubes", "cause"),
    [
        (("cube_red_0", "cube_red_1", "cube_red_2"), "put more than 2 red cubes into the bin"),
        (("cube_red_0", "cube_blue_0", "cube_blue_1"), "put fewer than 2 red cubes into the bin"),
        (("cube_red_0", "cube_red_1", "cube_green_0"), "put no blue cube into the bin"),
        (("cube_blue_0", "cube_blue_1", "cube_blue_2"), "put fewer than 2 red cubes into the bin"),
    ],
)
def test_bin_fill_punishes_a_wrong_mix_one_step_after_the_last_drop(cubes, cause):
    assert filled(*cubes).status is Status.ONGOING

    judge = filled(*cubes, then=[[]])
    assert judge.status is Status.FAILURE
    assert judge.cause == f"{cause}; expected: press the button"


@pytest.mark.parametrize(
    ("extra", "cause"),
    [
        ("cube_red_2", "put more than 2 red cubes into the bin"),
        ("cube_blue_1", "put more than 1 blue cube into the bin"),
        ("cube_green_0", "put a green cube into the bin"),
    ],
)
def test_bin_fill_punishes_one_cube_too_many_as_it_lands_but_not_its_picking(extra, cause):
    right = ("cube_red_0", "cube_red_1", "cube_blue_0")
    held = filled(*right, then=[[], [picked(extra)], []])
    assert held.status is Status.ONGOING

    landed = filled(*right, then=[[], [picked(extra)], [Fact("binned", extra, "bin")]])
    assert landed.status is Status.FAILURE
    assert landed.cause.startswith(cause)


def test_bin_fill_does_not_punish_dropping_beside_and_picking_again():
    steps = [[picked("cube_green_0")], [], [picked("cube_red_0")], [], [picked("cube_red_0")], []]
    assert judged(FILL, FILL_SCENE, *steps).status is Status.ONGOING

    rest = fill("cube_red_0", "cube_red_1", "cube_blue_0")
    inside = [Fact("binned", c, "bin") for c in ("cube_red_0", "cube_red_1", "cube_blue_0")]
    judge = judged(FILL, FILL_SCENE, *steps, *rest, inside, [*inside, PRESSED])
    assert judge.status is Status.SUCCESS


# SwingXtimes: the red cube, twice.

SWING_SCENE = scene_of(swing_x_times, lambda _scene: True)
SWING = swing_x_times.stages(SWING_SCENE, Goal.of(color="red", repeats=2))
HELD = picked("cube_red")
LYING = Fact("lying", "cube_red")
RIGHT, LEFT = (Fact("over", "cube_red", f"target_{side}") for side in ("right", "left"))
TAKE = [[LYING], [HELD]]
SWUNG = [[HELD, RIGHT], [HELD, RIGHT], [HELD], [HELD, LEFT], [HELD]]


def swung(*steps):
    return judged(SWING, SWING_SCENE, *steps)


def test_swing_is_done_after_the_swings_the_put_down_and_the_press():
    judge = swung(*TAKE, *SWUNG, *SWUNG, [LYING], [LYING, PRESSED])
    assert judge.status is Status.SUCCESS


def test_swing_is_done_where_the_cube_was_put_down_over_the_target():
    judge = swung(*TAKE, *SWUNG, *SWUNG[:-1], [LEFT, LYING], [LEFT, LYING, PRESSED])
    assert judge.status is Status.SUCCESS


def test_swing_punishes_another_cube_in_every_stage():
    whole = [[HELD], [HELD, RIGHT], [HELD, LEFT], [HELD, RIGHT], [HELD, LEFT], [LYING]]
    for done in range(len(whole) + 1):
        for wrong in ("cube_green", "cube_blue"):
            judge = swung(*whole[:done], [picked(wrong)])
            assert judge.status is Status.FAILURE
            assert judge.cause.startswith(f"picked up the {wrong[5:]} cube")


@pytest.mark.parametrize("side", [RIGHT, LEFT])
def test_swing_punishes_a_visit_too_many_before_and_after_the_put_down(side):
    swings = [*TAKE, *SWUNG, *SWUNG]
    for steps in ([*swings, [HELD, side]], [*swings, [LYING], [HELD], [HELD, side]]):
        assert swung(*steps[:-1]).status is Status.ONGOING
        judge = swung(*steps)
        assert judge.status is Status.FAILURE
        assert judge.cause.startswith("moved the cube over a target too often")


def test_swing_visits_of_other_cubes_do_not_count():
    other = [[HELD, Fact("over", "cube_blue", "target_right")], [HELD]] * 6
    steps = [*TAKE, *other, *SWUNG, *SWUNG, [LYING], [LYING, PRESSED]]
    assert swung(*steps).status is Status.SUCCESS


def test_swing_does_not_punish_dropping_on_the_way_nor_picking_after_the_put_down():
    dropped = [[LYING], [LYING], [HELD]]
    steps = [*TAKE, *SWUNG, *dropped, *SWUNG, [LYING], [HELD], [LYING], [LYING, PRESSED]]
    assert swung(*steps).status is Status.SUCCESS


# StopCube: 120 steps a pass, the third visit, whose middle is at step 300.

INTERVAL = 120
VISIT = 3
HOVER = Fact("hovering", "robot", "button")
NEAR, STOPPED = (Fact(kind, "shuttle", "target") for kind in ("near", "stopped"))


def has_interval(scene):
    return any(isinstance(run, Shuttle) and run.interval == INTERVAL for run in scene.motions)


STOP_SCENE = scene_of(stop_cube, has_interval)
STOP = stop_cube.stages(STOP_SCENE, Goal.of(visit=VISIT))


def run(pressed_at=None, hover_at=40, until=500):
    """The facts of every step: near within 8 steps of each pass's middle, until it is stopped."""
    stopped = False
    for step in range(until):
        facts = set()
        near = min(abs(step - (number - 0.5) * INTERVAL) for number in range(1, 6)) <= 8
        if hover_at is not None and step >= hover_at:
            facts.add(HOVER)
        if stopped or near:
            facts.add(NEAR)
        if pressed_at is not None and pressed_at <= step < pressed_at + 10:
            facts.add(PRESSED)
            stopped = stopped or near
        if stopped:
            facts.add(STOPPED)
        yield facts


def stop(**how):
    """The judge, and the step at which it gave its verdict."""
    judge = Judge(STOP, STOP_SCENE)
    for step, facts in enumerate(run(**how)):
        if judge.update(step, frozenset(facts)) is not Status.ONGOING:
            return judge, step
    return judge, None


OFF = "pressed the button while the cube was off the target"
EARLY = "stopped the cube on an earlier"
PASSED = "let the cube's third visit pass"
OVER = 3 * INTERVAL + 1


@pytest.mark.parametrize("pressed_at", [292, 300, 308])
def test_stop_cube_is_done_when_stopped_on_the_wanted_visit(pressed_at):
    judge, step = stop(pressed_at=pressed_at)
    assert (judge.status, step) == (Status.SUCCESS, pressed_at)


@pytest.mark.parametrize(
    ("how", "at", "cause"),
    [
        # Off the target at once, on an earlier visit when it is time to press.
        *(({"pressed_at": step}, step, OFF) for step in (0, 20, 120, 200, 280, 291, 309)),
        *(({"pressed_at": step}, 270 + 1, EARLY) for step in (60, 180, 188)),
        ({"pressed_at": 180, "hover_at": None}, OVER, PASSED),
        *((late, OVER, PASSED) for late in ({}, {"pressed_at": 420}, {"hover_at": None})),
    ],
)
def test_stop_cube_punishes_other_moments(how, at, cause):
    judge, step = stop(**how)
    assert (judge.status, step) == (Status.FAILURE, at)
    assert judge.cause.startswith(cause)
    assert judge.cause.endswith("; expected: wait") == (at in (120, 200))


def test_stop_cube_a_late_hover_catches_up():
    judge, step = stop(pressed_at=300, hover_at=299)
    assert judge.status is Status.SUCCESS
    assert step <= 300 + 7
    assert stop(pressed_at=300, hover_at=340)[0].status is Status.SUCCESS
