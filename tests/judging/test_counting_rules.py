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
    """Return the judge after cubes were dropped into the bin, and then the facts of more steps.

    The goal is two red cubes and a blue one, then to press the button.
    """
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
    filled = judged_after_filling(*cubes, then=[[]])
    pressed = judged_after_filling(*cubes, then=[[], [PRESSED]])

    assert filled.status is Status.ONGOING
    assert pressed.status is Status.SUCCESS


def test_bin_fill_accepts_a_press_in_the_step_after_the_last_drop():
    """The goal is two red cubes and a blue one, which are in the bin, then to press the button.
    `then` has the facts of the steps after the last drop."""
    judge = judged_after_filling("cube_red_0", "cube_red_1", "cube_blue_0", then=[[PRESSED]])

    assert judge.status is Status.SUCCESS


@pytest.mark.parametrize("cubes", [(), ("cube_red_0",), ("cube_red_0", "cube_red_1")])
def test_bin_fill_punishes_a_press_before_the_last_drop(cubes):
    """The goal is two red cubes and a blue one, then to press the button."""
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
    at_the_drop = judged_after_filling(*cubes)
    a_step_later = judged_after_filling(*cubes, then=[[]])

    assert at_the_drop.status is Status.ONGOING
    assert a_step_later.status is Status.FAILURE
    assert a_step_later.cause == f"{cause}; expected: press the button"


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
    binned = Fact("binned", extra, "bin")

    held = judged_after_filling(*right, then=[[], [picked(extra)], []])
    landed = judged_after_filling(*right, then=[[], [picked(extra)], [binned]])

    assert held.status is Status.ONGOING
    assert landed.status is Status.FAILURE
    assert landed.cause.startswith(cause)


def test_bin_fill_does_not_punish_dropping_beside_and_picking_again():
    """A green and a red cube fall next to the bin; then the two red and the blue one go in."""
    drops = [[picked("cube_green_0")], [], [picked("cube_red_0")], [], [picked("cube_red_0")], []]
    filling = facts_of_filling("cube_red_0", "cube_red_1", "cube_blue_0")

    judge = judged(TWO_RED_ONE_BLUE, FILL_SCENE, *drops, *filling)

    assert judge.status is Status.ONGOING


# SwingXtimes: the red cube, twice.

SWING_SCENE = scene_of(swing_x_times, lambda _scene: True)
RED_TWICE = swing_x_times.stages(SWING_SCENE, Goal.of(color="red", repeats=2))
RED_HELD = picked("cube_red")
RED_LYING = Fact("lying", "cube_red")
RIGHT, LEFT = (Fact("over", "cube_red", f"target_{side}") for side in ("right", "left"))
PICK_RED = [[RED_LYING], [RED_HELD]]
RIGHT_THEN_LEFT = [[RED_HELD, RIGHT], [RED_HELD, RIGHT], [RED_HELD], [RED_HELD, LEFT], [RED_HELD]]
SWINGS = [*RIGHT_THEN_LEFT, *RIGHT_THEN_LEFT]
SIX_VISITS_OF_BLUE = [[RED_HELD, Fact("over", "cube_blue", "target_right")], [RED_HELD]] * 6
FALL = [[RED_LYING], [RED_LYING], [RED_HELD]]


def judged_swings(*steps):
    """Return the judge after steps with these facts; the goal is to swing the red cube twice."""
    return judged(RED_TWICE, SWING_SCENE, *steps)


@pytest.mark.parametrize(
    "steps",
    [
        SWINGS,
        [*SIX_VISITS_OF_BLUE, *SWINGS],
        [*RIGHT_THEN_LEFT, *FALL, *RIGHT_THEN_LEFT],
        [*SWINGS, [RED_LYING], [RED_HELD]],
    ],
    ids=["as planned", "visits of another cube", "a fall in between", "picked up once more"],
)
def test_swing_is_done_after_the_swings_the_put_down_and_the_press(steps):
    """The goal is to swing the red cube from the right to the left target, twice. PICK_RED and
    RIGHT_THEN_LEFT have the facts of the steps of a pick and of one such swing. A blue cube may be
    over the right target meanwhile, and the red one may fall, or be picked up after a put-down."""
    judge = judged_swings(*PICK_RED, *steps, [RED_LYING], [RED_LYING, PRESSED])

    assert judge.status is Status.SUCCESS


def test_swing_succeeds_if_the_cube_is_put_down_over_the_left_target():
    """The red cube, twice; lying down over a target is no visit too many."""
    down = [[LEFT, RED_LYING], [LEFT, RED_LYING, PRESSED]]

    judge = judged_swings(*PICK_RED, *SWINGS[:-1], *down)

    assert judge.status is Status.SUCCESS


def test_swing_punishes_another_cube_in_every_stage():
    """The goal is the red cube, twice: a pick, two swings each way, and a put-down."""
    right = [RED_HELD, RIGHT]
    left = [RED_HELD, LEFT]
    whole = [[RED_HELD], right, left, right, left, [RED_LYING]]
    for done in range(7):
        judge = judged_swings(*whole[:done], [picked("cube_green")])

        assert judge.status is Status.FAILURE, done
        assert judge.cause.startswith("picked up the green cube"), done


@pytest.mark.parametrize("side", [RIGHT, LEFT])
@pytest.mark.parametrize("put_down", [[], [[RED_LYING], [RED_HELD]]], ids=["before", "after"])
def test_swing_punishes_a_visit_too_many_before_and_after_the_put_down(side, put_down):
    """The red cube was swung twice from the right to the left target, as is meant: four visits.
    `side` is the fact that it is over one of the targets a fifth time, before or after it was
    put down."""
    swings = [*PICK_RED, *SWINGS, *put_down]

    judge = judged_swings(*swings, [RED_HELD, side])

    assert judged_swings(*swings).status is Status.ONGOING
    assert judge.status is Status.FAILURE
    assert judge.cause.startswith("moved the cube over a target too often")


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


def verdict_and_step(**hands):
    """Return the judge, and the step at which it gave its verdict.

    Args:
        hands: step at which the button is pressed (`pressed_at`; never by default), and from which
            on the hand is above it (`hover_at`; 40 by default).
    """
    judge = Judge(THIRD_VISIT, STOP_SCENE)
    for step, facts in enumerate(facts_of_a_run(**hands)):
        if judge.update(step, frozenset(facts)) is not Status.ONGOING:
            return judge, step
    return judge, None


@pytest.mark.parametrize("pressed_at", [292, 300, 308])
def test_stop_cube_is_done_when_stopped_on_the_wanted_visit(pressed_at):
    """The cube passes its target every 120 steps; the middle of the third visit is step 300, and it
    is on the target for 8 steps before and after. A press in that time stops it there at once."""
    judge, step = verdict_and_step(pressed_at=pressed_at)

    assert (judge.status, step) == (Status.SUCCESS, pressed_at)


@pytest.mark.parametrize(
    ("step", "due"),
    [
        (0, "move to the top of the button"),
        (120, "wait"),
        (200, "wait"),
        (291, "press"),
        (309, "press"),
    ],
)
def test_stop_cube_fails_at_once_if_the_button_is_pressed_while_the_cube_is_off_the_target(
    step, due
):
    """The third visit is meant; the cube is on the target at steps 292 to 308, and 120 before.
    `due` is the stage of the plan at that step: the hand is above the button from step 40 on,
    and it is time to press after step 270."""
    judge, verdict_step = verdict_and_step(pressed_at=step)

    cause = "pressed the button while the cube was off the target"
    assert (judge.status, verdict_step) == (Status.FAILURE, step)
    assert judge.cause.startswith(f"{cause}; expected: {due}")


@pytest.mark.parametrize("pressed_at", [60, 180, 188])
def test_stop_cube_fails_when_it_is_time_to_press_if_the_cube_was_stopped_on_an_earlier_visit(
    pressed_at,
):
    """The third visit is meant, whose middle is at step 300; the first ones are at 60 and 180. It
    is time to press after step 270, so the mistake is noticed at step 271."""
    judge, step = verdict_and_step(pressed_at=pressed_at)

    assert (judge.status, step) == (Status.FAILURE, 271)
    assert judge.cause.startswith("stopped the cube on an earlier")


@pytest.mark.parametrize(
    "hands",
    [{}, {"pressed_at": 420}, {"hover_at": None}, {"pressed_at": 180, "hover_at": None}],
    ids=["never pressed", "pressed too late", "never there", "pressed but never there"],
)
def test_stop_cube_fails_when_the_wanted_visit_has_passed(hands):
    """The third visit ends with the third pass of 120 steps, at step 360, so the verdict is at step
    361. In the last two cases the hand is never above the button."""
    judge, step = verdict_and_step(**hands)

    assert (judge.status, step) == (Status.FAILURE, 361)
    assert judge.cause.startswith("let the cube's third visit pass")


@pytest.mark.parametrize(("hover_at", "latest"), [(299, 307), (340, 499)])
def test_stop_cube_succeeds_though_the_hand_comes_to_the_button_late(hover_at, latest):
    """The stages before the press are to hover over the button and to wait, one evaluation each."""
    judge, step = verdict_and_step(pressed_at=300, hover_at=hover_at)

    assert judge.status is Status.SUCCESS
    assert step <= latest
