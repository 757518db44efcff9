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
TWO_RED_ONE_BLUE = bin_fill.stages(FILL_SCENE, Goal.of(colors=("red", "blue"), counts=(2, 1)))


def picked(cube):
    return Fact("picked", cube)


def facts_of_filling(*cubes):
    """Facts of picking each cube and dropping it into the bin, where it counts for ever."""
    inside = []
    for cube in cubes:
        yield [picked(cube), *inside]
        yield list(inside)
        inside.append(Fact("binned", cube, "bin"))
        yield list(inside)


def judged_after_filling(*cubes, then=()):
    inside = [Fact("binned", cube, "bin") for cube in cubes]
    return judged(
        TWO_RED_ONE_BLUE,
        FILL_SCENE,
        *facts_of_filling(*cubes),
        *([*inside, *facts] for facts in then),
    )


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
    """The goal is two red cubes and a blue one, then to press the button."""
    assert judged_after_filling(*cubes, then=[[]]).status is Status.ONGOING
    assert judged_after_filling(*cubes, then=[[], [PRESSED]]).status is Status.SUCCESS
    assert judged_after_filling(*cubes, then=[[PRESSED]]).status is Status.SUCCESS


def test_bin_fill_punishes_a_press_before_the_last_drop():
    """The goal is two red cubes and a blue one, then to press the button."""
    assert judged_after_filling(then=[[PRESSED]]).status is Status.FAILURE
    for cubes in (("cube_red_0",), ("cube_red_0", "cube_red_1")):
        judge = judged_after_filling(*cubes, then=[[PRESSED]])
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
    """The goal is two red cubes and a blue one; three cubes are in, but not these."""
    assert judged_after_filling(*cubes).status is Status.ONGOING

    judge = judged_after_filling(*cubes, then=[[]])
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
    """The goal is two red cubes and a blue one, and a fourth cube follows."""
    right = ("cube_red_0", "cube_red_1", "cube_blue_0")
    held = judged_after_filling(*right, then=[[], [picked(extra)], []])
    assert held.status is Status.ONGOING

    landed = judged_after_filling(
        *right, then=[[], [picked(extra)], [Fact("binned", extra, "bin")]]
    )
    assert landed.status is Status.FAILURE
    assert landed.cause.startswith(cause)


def test_bin_fill_does_not_punish_dropping_beside_and_picking_again():
    """A green and a red cube fall next to the bin; then the two red and the blue one go in."""
    steps = [[picked("cube_green_0")], [], [picked("cube_red_0")], [], [picked("cube_red_0")], []]
    assert judged(TWO_RED_ONE_BLUE, FILL_SCENE, *steps).status is Status.ONGOING

    rest = facts_of_filling("cube_red_0", "cube_red_1", "cube_blue_0")
    inside = [Fact("binned", c, "bin") for c in ("cube_red_0", "cube_red_1", "cube_blue_0")]
    judge = judged(TWO_RED_ONE_BLUE, FILL_SCENE, *steps, *rest, inside, [*inside, PRESSED])
    assert judge.status is Status.SUCCESS


# SwingXtimes: the red cube, twice.

SWING_SCENE = scene_of(swing_x_times, lambda _scene: True)
RED_TWICE = swing_x_times.stages(SWING_SCENE, Goal.of(color="red", repeats=2))
RED_HELD = picked("cube_red")
RED_LYING = Fact("lying", "cube_red")
RIGHT, LEFT = (Fact("over", "cube_red", f"target_{side}") for side in ("right", "left"))
PICK_RED = [[RED_LYING], [RED_HELD]]
RIGHT_THEN_LEFT = [[RED_HELD, RIGHT], [RED_HELD, RIGHT], [RED_HELD], [RED_HELD, LEFT], [RED_HELD]]


def judged_swings(*steps):
    return judged(RED_TWICE, SWING_SCENE, *steps)


def test_swing_is_done_after_the_swings_the_put_down_and_the_press():
    """The goal is to swing the red cube from the right to the left target, twice."""
    judge = judged_swings(
        *PICK_RED, *RIGHT_THEN_LEFT, *RIGHT_THEN_LEFT, [RED_LYING], [RED_LYING, PRESSED]
    )
    assert judge.status is Status.SUCCESS


def test_swing_succeeds_if_the_cube_is_put_down_over_the_left_target():
    """The red cube, twice; lying down over a target is no visit too many."""
    judge = judged_swings(
        *PICK_RED,
        *RIGHT_THEN_LEFT,
        *RIGHT_THEN_LEFT[:-1],
        [LEFT, RED_LYING],
        [LEFT, RED_LYING, PRESSED],
    )
    assert judge.status is Status.SUCCESS


def test_swing_punishes_another_cube_in_every_stage():
    """The goal is the red cube, twice: a pick, two swings each way, and a put-down."""
    whole = [
        [RED_HELD],
        [RED_HELD, RIGHT],
        [RED_HELD, LEFT],
        [RED_HELD, RIGHT],
        [RED_HELD, LEFT],
        [RED_LYING],
    ]
    for done in range(len(whole) + 1):
        for wrong in ("cube_green", "cube_blue"):
            judge = judged_swings(*whole[:done], [picked(wrong)])
            assert judge.status is Status.FAILURE
            assert judge.cause.startswith(f"picked up the {wrong[5:]} cube")


@pytest.mark.parametrize("side", [RIGHT, LEFT])
def test_swing_punishes_a_visit_too_many_before_and_after_the_put_down(side):
    """`side` is the fact that the red cube is over one of the targets a fifth time."""
    swings = [*PICK_RED, *RIGHT_THEN_LEFT, *RIGHT_THEN_LEFT]
    for steps in (
        [*swings, [RED_HELD, side]],
        [*swings, [RED_LYING], [RED_HELD], [RED_HELD, side]],
    ):
        assert judged_swings(*steps[:-1]).status is Status.ONGOING
        judge = judged_swings(*steps)
        assert judge.status is Status.FAILURE
        assert judge.cause.startswith("moved the cube over a target too often")


def test_swing_visits_of_other_cubes_do_not_count():
    """A blue cube is over the right target six times, without having been picked up."""
    other = [[RED_HELD, Fact("over", "cube_blue", "target_right")], [RED_HELD]] * 6
    steps = [
        *PICK_RED,
        *other,
        *RIGHT_THEN_LEFT,
        *RIGHT_THEN_LEFT,
        [RED_LYING],
        [RED_LYING, PRESSED],
    ]
    assert judged_swings(*steps).status is Status.SUCCESS


def test_swing_does_not_punish_dropping_on_the_way_nor_picking_after_the_put_down():
    """The red cube falls between the two swings, and is lifted once more at the end."""
    dropped = [[RED_LYING], [RED_LYING], [RED_HELD]]
    steps = [
        *PICK_RED,
        *RIGHT_THEN_LEFT,
        *dropped,
        *RIGHT_THEN_LEFT,
        [RED_LYING],
        [RED_HELD],
        [RED_LYING],
        [RED_LYING, PRESSED],
    ]
    assert judged_swings(*steps).status is Status.SUCCESS


# StopCube: 120 steps a pass, the third visit, whose middle is at step 300.

INTERVAL = 120
VISIT = 3
HOVER = Fact("hovering", "robot", "button")
NEAR, STOPPED = (Fact(kind, "shuttle", "target") for kind in ("near", "stopped"))


def has_interval(scene):
    return any(
        isinstance(motion, Shuttle) and motion.interval == INTERVAL for motion in scene.motions
    )


STOP_SCENE = scene_of(stop_cube, has_interval)
THIRD_VISIT = stop_cube.stages(STOP_SCENE, Goal.of(visit=VISIT))


def facts_of_a_run(pressed_at=None, hover_at=40, until=500):
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


def verdict_and_step(**how):
    """The judge, and the step at which it gave its verdict."""
    judge = Judge(THIRD_VISIT, STOP_SCENE)
    for step, facts in enumerate(facts_of_a_run(**how)):
        if judge.update(step, frozenset(facts)) is not Status.ONGOING:
            return judge, step
    return judge, None


NOT_ON_TARGET = "pressed the button while the cube was off the target"
EARLIER_VISIT = "stopped the cube on an earlier"
VISIT_PASSED = "let the cube's third visit pass"
AFTER_THIRD_VISIT = 3 * INTERVAL + 1


@pytest.mark.parametrize("pressed_at", [292, 300, 308])
def test_stop_cube_is_done_when_stopped_on_the_wanted_visit(pressed_at):
    """The cube passes its target every 120 steps; the middle of the third visit is step 300."""
    judge, step = verdict_and_step(pressed_at=pressed_at)
    assert (judge.status, step) == (Status.SUCCESS, pressed_at)


@pytest.mark.parametrize(
    ("how", "at", "cause"),
    [
        # Off the target at once, on an earlier visit when it is time to press.
        *(({"pressed_at": step}, step, NOT_ON_TARGET) for step in (0, 20, 120, 200, 280, 291, 309)),
        *(({"pressed_at": step}, 270 + 1, EARLIER_VISIT) for step in (60, 180, 188)),
        ({"pressed_at": 180, "hover_at": None}, AFTER_THIRD_VISIT, VISIT_PASSED),
        *(
            (late, AFTER_THIRD_VISIT, VISIT_PASSED)
            for late in ({}, {"pressed_at": 420}, {"hover_at": None})
        ),
    ],
)
def test_stop_cube_fails_if_the_button_is_pressed_off_the_target_or_on_another_visit(
    how, at, cause
):
    """The third visit is meant, steps 292 to 308; `at` is the step of the verdict.

    An earlier visit is punished only when it is time to press, at step 271.
    """
    judge, step = verdict_and_step(**how)
    assert (judge.status, step) == (Status.FAILURE, at)
    assert judge.cause.startswith(cause)
    assert judge.cause.endswith("; expected: wait") == (at in (120, 200))


def test_stop_cube_succeeds_though_the_hand_comes_to_the_button_late():
    """The stages before the press are to hover over the button and to wait, one evaluation each."""
    judge, step = verdict_and_step(pressed_at=300, hover_at=299)
    assert judge.status is Status.SUCCESS
    assert step <= 300 + 7
    assert verdict_and_step(pressed_at=300, hover_at=340)[0].status is Status.SUCCESS
