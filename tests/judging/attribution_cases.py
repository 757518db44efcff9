"""Episodes that fail, one way each: what the hands do, by task and by what should be said of it.

A case gets a stage on which nothing has been done yet and plays on it, unless the episode does not
offer what it needs (a second cube, say).
"""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

from staged import Staged

from roboirg.core.conditions import Fact
from roboirg.core.motions import Shuttle
from roboirg.language import instruct, mirrored_objects

Play = Callable[[Staged], None]


class Case(NamedTuple):
    """One way to fail.

    Attributes:
        tasks: for which it is.
        failure: what should be said of it.
        play: does it.
        early: whether the judge ends it; else time does.
    """

    tasks: tuple[str, ...]
    failure: str
    play: Play
    early: bool


CASES: list[Case] = []


class NotOfferedError(Exception):
    """The episode does not offer what a case needs."""


def need(offered: object) -> None:
    if not offered:
        raise NotOfferedError


PICKING = (
    "PickXtimes",
    "SwingXtimes",
    "VideoRepick",
    "VideoPlaceButton",
    "VideoPlaceOrder",
    "PickByCount",
)
PLACING = ("VideoPlaceButton", "VideoPlaceOrder")
VIDEO_UNMASK = ("VideoUnmask", "VideoUnmaskSwap")
BUTTON_UNMASK = ("ButtonUnmask", "ButtonUnmaskSwap")
UNMASK = (*VIDEO_UNMASK, *BUTTON_UNMASK)
PICK = "pick_container"
MOVABLE = (*PICKING, *UNMASK, "BinFill", "PutInBox")


def case(failure: str, *tasks: str, early: bool = True) -> Callable[[Play], Play]:
    def keep(play: Play) -> Play:
        CASES.append(Case(tasks, failure, play, early))
        return play

    return keep


def until(staged: Staged, kind: str, number: int = 1) -> int:
    """Play as wanted up to the n-th stage of a kind; its index."""
    kinds = [stage.primitive.kind for stage in staged.episode.stages]
    index = [at for at, found in enumerate(kinds) if found == kind][number - 1]
    staged.play(staged.episode.stages[:index])
    return index


def kinds(staged: Staged) -> list[str]:
    return [stage.primitive.kind for stage in staged.episode.stages]


def first_pick(staged: Staged) -> str:
    """Everything up to the first pick; what is to be picked."""
    kind = "pick_container" if staged.episode.task in UNMASK else "pick_cube"
    return staged.episode.stages[until(staged, kind)].primitive.subject


def others(staged: Staged, name: str, *but: str) -> list[str]:
    """Things of the same kind."""
    same = staged.episode.scene.of_kind(staged.episode.scene[name].kind)
    return [item.name for item in same if item.name not in (name, *but)]


def of_color(staged: Staged, color: str) -> list[str]:
    return [c.name for c in staged.episode.scene.of_kind("cube") if c.color == color]


def unwanted(staged: Staged) -> list[str]:
    """Cubes of colors that BinFill's goal does not name."""
    named = staged.episode.goal.texts("colors")
    return [c.name for c in staged.episode.scene.of_kind("cube") if c.color not in named]


# Nothing, or not enough


@case("nothing_reached", *MOVABLE, early=False)
def nothing(staged: Staged) -> None:
    staged.tick(200)


@case("nothing_reached", "StopCube")
def stays_away_from_the_button(staged: Staged) -> None:
    staged.tick(700)


@case("nothing_reached", *PICKING, early=False)
def goes_to_another_cube_without_taking_it(staged: Staged) -> None:
    target = first_pick(staged)
    need(others(staged, target))
    staged.miss(others(staged, target)[0]).tick(50)


@case("missed_grasp", *MOVABLE, early=False)
def misses(staged: Staged) -> None:
    target = first_pick(staged)
    staged.miss(target).tick(50).miss(target)


@case("missed_grasp", *MOVABLE, early=False)
def loses_it_before_it_is_up(staged: Staged) -> None:
    target = first_pick(staged)
    staged.grasp(target).set(off=(Fact("held", target), Fact("reached", target))).tick(50)


@case("missed_grasp", "PickXtimes", "VideoRepick", "BinFill")
def misses_the_last_time_and_goes_on(staged: Staged) -> None:
    picks = [at for at, kind in enumerate(kinds(staged)) if kind == "pick_cube"]
    staged.play(staged.episode.stages[: picks[-1]]).tick(60)
    staged.miss(staged.episode.stages[picks[-1]].primitive.subject).press()


@case("wrong_count", "PickXtimes", "BinFill", "VideoRepick")
def misses_one_of_several_and_presses(staged: Staged) -> None:
    need(kinds(staged).count("pick_cube") >= 2)
    staged.miss(first_pick(staged)).tick(60).press()


@case("missed_grasp", "SwingXtimes")
def swings_nothing(staged: Staged) -> None:
    staged.miss(first_pick(staged)).tick(100).press()


@case("out_of_time", *MOVABLE, early=False)
def too_slow(staged: Staged) -> None:
    staged.grasp(first_pick(staged))


@case("out_of_time", *BUTTON_UNMASK, early=False)
def no_time_for_the_containers(staged: Staged) -> None:
    first_pick(staged)
    staged.tick(50)


@case("out_of_time", "PickXtimes", "SwingXtimes", "BinFill", "VideoRepick", early=False)
def no_time_for_the_press(staged: Staged) -> None:
    until(staged, "press")
    staged.hover().tick(20)


@case("out_of_time", *PLACING, "PickXtimes", "BinFill", "PutInBox", early=False)
def with_the_cube_in_the_hand(staged: Staged) -> None:
    staged.do(staged.episode.stages[0]).tick(500)


@case("out_of_time", "ButtonUnmask", early=False)
def above_the_button_without_pressing(staged: Staged) -> None:
    staged.hover().set(off=(Fact("hovering", "robot", "button"),)).tick(50)


@case("out_of_time", *UNMASK, early=False)
def rests_a_moment_after_the_first_of_two(staged: Staged) -> None:
    need(kinds(staged).count(PICK) >= 2)
    staged.lift(first_pick(staged)).set(Fact("still", "robot")).tick(99)


@case("out_of_time", "StopCube", early=False)
def no_time_to_wait(staged: Staged) -> None:
    staged.hover().tick(10)


# Let go


@case("dropped", *PLACING, "PickXtimes", "SwingXtimes", "BinFill", "PutInBox", early=False)
@case("dropped", "PickByCount", early=False)
def drops(staged: Staged) -> None:
    target = first_pick(staged)
    staged.lift(target).tick(5).drop(target).tick(50)


@case("dropped", *PLACING, early=False)
def drops_on_the_site(staged: Staged) -> None:
    target = first_pick(staged)
    staged.lift(target).tick(5).drop(target, "site").miss(target)


@case("dropped", "PickXtimes", "BinFill")
def drops_one_puts_the_next_beside_and_goes_on(staged: Staged) -> None:
    stages = staged.episode.stages
    need(len(stages) >= 5)
    target = first_pick(staged)
    staged.lift(target).tick(5).drop(target).do(stages[2])
    staged.put(stages[2].primitive.subject).play(stages[4:])


@case("misplaced", *PLACING, "PickXtimes", "BinFill", "PutInBox", "PickByCount", early=False)
def puts_it_beside_after_a_drop(staged: Staged) -> None:
    target = first_pick(staged)
    staged.lift(target).drop(target).lift(target).put(target).tick(50)


@case("misplaced", "SwingXtimes", early=False)
def puts_it_down_too_soon(staged: Staged) -> None:
    staged.do(staged.episode.stages[0]).put(staged.episode.stages[0].primitive.subject)


@case("misplaced", "PickXtimes", "BinFill")
def puts_the_last_one_beside_and_presses(staged: Staged) -> None:
    picks = [at for at, kind in enumerate(kinds(staged)) if kind == "pick_cube"]
    staged.play(staged.episode.stages[: picks[-1] + 1])
    staged.put(staged.episode.stages[picks[-1]].primitive.subject).press()


@case("misplaced", "StopCube")
def stops_beside_the_target(staged: Staged) -> None:
    press = staged.episode.stages[-1].primitive
    staged.hover().until(press.steps - 15).press()


@case("dropped", *UNMASK, early=False)
def drops_a_container(staged: Staged) -> None:
    need(kinds(staged).count("pick_container") >= 2)
    target = first_pick(staged)
    grips = (Fact("lifted", target), Fact("held", target), Fact("reached", target))
    staged.lift(target).tick(5).set(off=grips).tick(50)


@case("misplaced", *UNMASK, early=False)
def tips_a_container_over(staged: Staged) -> None:
    need(kinds(staged).count(PICK) >= 2)
    target = first_pick(staged)
    staged.lift(target).set(off=(Fact("lifted", target),)).tick(3)
    staged.set(off=(Fact("held", target), Fact("reached", target))).tick(50)


@case("misplaced", "VideoRepick", early=False)
def puts_it_on_top_of_something(staged: Staged) -> None:
    target = first_pick(staged)
    staged.lift(target).set(off=(Fact("picked", target),)).tick(3)
    staged.set(off=(Fact("held", target), Fact("reached", target))).tick(20)


@case("dropped", "VideoRepick", early=False)
def drops_it_on_top_of_something(staged: Staged) -> None:
    target = first_pick(staged)
    grips = (Fact("picked", target), Fact("held", target), Fact("reached", target))
    staged.lift(target).set(off=grips).tick(20)


# The wrong thing


@case("wrong_object", *PICKING)
def picks_another_cube(staged: Staged) -> None:
    target = first_pick(staged)
    need(others(staged, target))
    staged.tick(100).lift(others(staged, target)[-1])


@case("wrong_object", "VideoRepick", "PickXtimes")
def picks_another_cube_the_last_time(staged: Staged) -> None:
    target = staged.episode.stages[0].primitive.subject
    need(others(staged, target))
    until(staged, "press")
    staged.lift(others(staged, target)[0])


@case("wrong_object", *PICKING, early=False)
def has_its_fingers_on_another_cube(staged: Staged) -> None:
    target = first_pick(staged)
    need(others(staged, target))
    staged.grasp(others(staged, target)[0]).tick(30)


@case("wrong_object", *PLACING, early=False)
def takes_another_cube_in_the_end(staged: Staged) -> None:
    stages = staged.episode.stages
    target, answer = stages[1].primitive[1:3]
    need(others(staged, target))
    other = others(staged, target)[0]
    staged.lift(target).put(target).lift(other).put(other, answer)


@case("wrong_object", *UNMASK)
def lifts_another_container(staged: Staged) -> None:
    wanted = [s.primitive.subject for s in staged.episode.stages if s.primitive.kind == PICK]
    target = first_pick(staged)
    rest = others(staged, target, *wanted)
    need(rest)
    staged.lift(rest[0])


@case("wrong_object", *UNMASK)
def lifts_another_container_second(staged: Staged) -> None:
    need(kinds(staged).count(PICK) >= 2)
    first = staged.episode.stages[until(staged, PICK)].primitive.subject
    staged.play(staged.episode.stages[kinds(staged).index(PICK) : -1]).lift(first)


@case("wrong_object", *BUTTON_UNMASK, early=False)
def lifts_another_container_and_forgets_the_button(staged: Staged) -> None:
    wanted = [s.primitive.subject for s in staged.episode.stages if s.primitive.kind == PICK]
    rest = others(staged, wanted[0], *wanted)
    need(rest)
    staged.tick(40).lift(rest[0]).tick(40)


@case("wrong_object", "ButtonUnmaskSwap", early=False)
def presses_the_same_button_twice(staged: Staged) -> None:
    staged.press("button_right").tick(10).press("button_right").tick(50)


@case("wrong_object", "BinFill")
def bins_a_color_that_was_not_named(staged: Staged) -> None:
    need(unwanted(staged))
    wrong = unwanted(staged)[0]
    staged.lift(wrong).fill(wrong, "bin").play(staged.episode.stages[2:])


@case("wrong_object", "BinFill", early=False)
def has_a_cube_of_another_color_in_the_hand(staged: Staged) -> None:
    need(unwanted(staged))
    staged.lift(unwanted(staged)[0]).tick(20)


@case("wrong_object", "BinFill", early=False)
def bins_another_color_and_stops(staged: Staged) -> None:
    need(unwanted(staged))
    wrong = unwanted(staged)[0]
    need(len(staged.episode.stages) > 3)  # the only one: the judge knows at once
    staged.lift(wrong).fill(wrong, "bin").tick(300)


# The wrong number


@case("wrong_count", "PickXtimes", "BinFill", "SwingXtimes")
def presses_at_once(staged: Staged) -> None:
    staged.press()


@case("wrong_count", "PickXtimes", "BinFill")
def presses_before_the_last_one(staged: Staged) -> None:
    need(len(staged.episode.stages) >= 5)
    staged.play(staged.episode.stages[:-3]).press()


@case("wrong_count", "VideoRepick")
def presses_before_the_last_lift(staged: Staged) -> None:
    need(len(staged.episode.stages) >= 5)
    staged.play(staged.episode.stages[:-3]).tick(60).press()


@case("wrong_count", "PickByCount", early=False)
def leaves_all_alone_too_early(staged: Staged) -> None:
    need(len(staged.episode.stages) >= 5)
    staged.play(staged.episode.stages[:2]).tick(300)


@case("out_of_time", "PickByCount", early=False)
def leaves_all_alone_for_a_moment(staged: Staged) -> None:
    need(len(staged.episode.stages) >= 5)
    staged.play(staged.episode.stages[:2]).tick(20)


@case("wrong_count", "PickByCount")
def once_too_often_before_the_end(staged: Staged) -> None:
    staged.play(staged.episode.stages[:-1]).lift(staged.episode.stages[0].primitive.subject)


@case("wrong_count", "SwingXtimes")
def one_swing_too_few(staged: Staged) -> None:
    stages = staged.episode.stages
    need(len(stages) >= 7)
    staged.play((*stages[:-4], stages[-2])).press()


@case("wrong_count", "SwingXtimes")
def drops_it_before_the_last_swing_and_presses(staged: Staged) -> None:
    last = max(at for at, kind in enumerate(kinds(staged)) if kind == "move_over")
    staged.play(staged.episode.stages[:last])
    staged.drop(staged.episode.stages[0].primitive.subject).press()


@case("wrong_count", "SwingXtimes")
def one_swing_too_many(staged: Staged) -> None:
    stages = staged.episode.stages
    staged.play((*stages[:3], *stages[1:-2]))


@case("wrong_count", "SwingXtimes")
def twice_over_the_same_side(staged: Staged) -> None:
    stages = staged.episode.stages
    staged.play((*stages[:2], *stages[1:]))


@case("wrong_count", "PickXtimes", "VideoRepick")
def once_too_often(staged: Staged) -> None:
    until(staged, "press")
    staged.lift(staged.episode.stages[0].primitive.subject)


@case("wrong_count", "BinFill")
def one_cube_too_many(staged: Staged) -> None:
    used = [s.primitive.subject for s in staged.episode.stages]
    color = staged.episode.goal.texts("colors")[0]
    spare = [cube for cube in of_color(staged, color) if cube not in used]
    need(spare)
    until(staged, "press")
    staged.lift(spare[0]).fill(spare[0], "bin")


@case("wrong_count", "BinFill", early=False)
def one_cube_too_many_in_the_hand(staged: Staged) -> None:
    used = [s.primitive.subject for s in staged.episode.stages]
    color = staged.episode.goal.texts("colors")[0]
    spare = [cube for cube in of_color(staged, color) if cube not in used]
    need(spare)
    until(staged, "press")
    staged.lift(spare[0])


@case("wrong_count", *UNMASK, early=False)
def rests_after_the_first_of_two(staged: Staged) -> None:
    need(kinds(staged).count(PICK) >= 2)
    staged.lift(first_pick(staged)).set(Fact("still", "robot")).tick(100)


# The wrong order


@case("wrong_order", *UNMASK)
def lifts_the_second_first(staged: Staged) -> None:
    need(kinds(staged).count(PICK) >= 2)
    first_pick(staged)
    staged.lift(staged.episode.stages[-1].primitive.subject)


@case("wrong_order", *UNMASK)
def lifts_the_second_before_the_first_is_down(staged: Staged) -> None:
    need(kinds(staged).count(PICK) >= 2)
    staged.lift(first_pick(staged)).lift(staged.episode.stages[-1].primitive.subject)


@case("wrong_order", *BUTTON_UNMASK, early=False)
def lifts_before_the_press(staged: Staged) -> None:
    stages = staged.episode.stages
    target = next(s.primitive.subject for s in stages if s.primitive.kind == PICK)
    staged.tick(40).lift(target).tick(5).put(target).tick(50)


@case("wrong_order", "SwingXtimes")
def begins_on_the_left(staged: Staged) -> None:
    pick, right, left, *_ = stages = staged.episode.stages
    staged.play((pick, *(left, right) * (len(stages) // 2), *stages[1:]))


@case("wrong_order", "SwingXtimes", early=False)
def stops_over_the_left_first(staged: Staged) -> None:
    pick, _, left, *_ = staged.episode.stages
    staged.do(pick).set(Fact("over", left.primitive.subject, left.primitive.place))


@case("wrong_order", "SwingXtimes", early=False)
def begins_on_the_left_and_stops(staged: Staged) -> None:
    pick, _, left, *_ = staged.episode.stages
    staged.play((pick, left)).tick(50)


@case("wrong_order", "SwingXtimes")
def presses_with_the_cube_in_the_hand(staged: Staged) -> None:
    staged.play(staged.episode.stages[:-2]).press()


@case("wrong_order", "VideoRepick")
def presses_with_the_right_cube_in_the_hand(staged: Staged) -> None:
    staged.play(staged.episode.stages[:-2]).tick(60).press()


# The wrong time


def interval(staged: Staged) -> int:
    return next(m.interval for m in staged.episode.scene.motions if isinstance(m, Shuttle))


@case("wrong_time", "StopCube")
def stops_it_one_visit_early(staged: Staged) -> None:
    staged.hover().until(staged.episode.stages[-1].primitive.steps - interval(staged) - 1)
    staged.press().tick(500)


@case("wrong_time", "StopCube")
def stops_it_at_once_and_without_waiting_above(staged: Staged) -> None:
    staged.until(interval(staged) // 2 - 1).set(Fact("pressed", "button")).tick(700)


@case("wrong_time", "StopCube")
def waits_for_a_later_visit(staged: Staged) -> None:
    staged.hover().tick(700)


@case("wrong_time", "StopCube")
def presses_between_two_visits(staged: Staged) -> None:
    staged.hover().until(staged.episode.stages[-1].primitive.steps - 35).press()


# The wrong place


@case("wrong_place", *PLACING)
def places_it_on_another_disc(staged: Staged) -> None:
    target, answer = staged.episode.stages[1].primitive[1:3]
    discs = [d.name for d in staged.episode.scene.of_kind("target") if d.name != answer]
    staged.lift(target).put(target, discs[-1])


@case("wrong_place", *PLACING)
def places_it_on_another_disc_after_a_misplaced_release(staged: Staged) -> None:
    target, answer = staged.episode.stages[1].primitive[1:3]
    discs = [d.name for d in staged.episode.scene.of_kind("target") if d.name != answer]
    staged.lift(target).drop(target).lift(target).put(target, discs[0])


@case("wrong_place", "PutInBox")
def puts_it_into_the_other_box(staged: Staged) -> None:
    right = staged.episode.stages[-1].primitive.place
    wrong = next(b.name for b in staged.episode.scene.of_kind("box") if b.name != right)
    staged.lift("tape").fill("tape", wrong)


# Mended: what was wrong at first is not what it failed by


@case("nothing_reached", *BUTTON_UNMASK, early=False)
def puts_another_container_back(staged: Staged) -> None:
    wanted = [s.primitive.subject for s in staged.episode.stages if s.primitive.kind == PICK]
    rest = others(staged, wanted[0], *wanted)
    need(rest)
    staged.tick(40).lift(rest[0]).tick(5).put(rest[0]).tick(50)


@case("out_of_time", "BinFill", early=False)
def puts_another_color_back(staged: Staged) -> None:
    need(unwanted(staged))
    wrong, right = unwanted(staged)[0], staged.episode.stages[0].primitive.subject
    staged.lift(wrong).put(wrong).lift(right).tick(50)


@case("out_of_time", *PLACING, "PickXtimes", early=False)
def picks_a_dropped_cube_up_again(staged: Staged) -> None:
    target = first_pick(staged)
    staged.lift(target).drop(target).lift(target).tick(50)


# The right words on the wrong side


def exchange_sides(staged: Staged) -> dict[str, str]:
    """Words that name a side; one of the objects that they would mean with left for right."""
    said = instruct(staged.episode, "spatial")
    staged.mirrored = mirrored_objects(staged.episode, said)
    return {meant: min(others) for meant, others in staged.mirrored.items()}


@case("mirrored_pick", "PickXtimes", "SwingXtimes", "PickByCount", *UNMASK)
def takes_the_object_on_the_other_side(staged: Staged) -> None:
    sides, target = exchange_sides(staged), first_pick(staged)
    need(target in sides)
    staged.lift(sides[target])


@case("mirrored_pick", *UNMASK)
def lifts_the_container_on_the_other_side_second(staged: Staged) -> None:
    need(kinds(staged).count(PICK) >= 2)
    sides, index = exchange_sides(staged), until(staged, PICK, 2)
    target = staged.episode.stages[index].primitive.subject
    need(target in sides)
    staged.lift(sides[target])


@case("mirrored_pick", "VideoUnmaskSwap")
def lifts_second_what_is_opposite_the_second_alone(staged: Staged) -> None:
    need(kinds(staged).count(PICK) >= 2)
    sides, index = exchange_sides(staged), until(staged, PICK, 2)
    wanted = [s.primitive.subject for s in staged.episode.stages if s.primitive.kind == PICK]
    wrong = sides.get(staged.episode.stages[index].primitive.subject)
    need(wrong)
    need(sides.get(wanted[0], wrong) != wrong)
    staged.lift(wrong)


@case("wrong_object", "VideoUnmaskSwap")
def lifts_first_what_is_opposite_the_second(staged: Staged) -> None:
    """Another object than the one opposite what is expected is any other one."""
    sides = exchange_sides(staged)
    wanted = [s.primitive.subject for s in staged.episode.stages if s.primitive.kind == PICK]
    wrong = sides.get(wanted[-1])
    need(wrong)
    need(sides.get(wanted[0], wrong) != wrong)
    first_pick(staged)
    staged.lift(wrong)


@case("mirrored_pick", "PickXtimes", early=False)
def holds_the_object_on_the_other_side(staged: Staged) -> None:
    sides, target = exchange_sides(staged), first_pick(staged)
    need(target in sides)
    staged.grasp(sides[target]).tick(30)


@case("mirrored_pick", "BinFill")
def bins_the_color_on_the_other_side(staged: Staged) -> None:
    sides, target = exchange_sides(staged), first_pick(staged)
    need(target in sides)
    assert sides[target] in unwanted(staged)
    staged.lift(sides[target]).fill(sides[target], "bin").play(staged.episode.stages[2:])


@case("mirrored_pick", "PutInBox")
def puts_it_into_the_box_on_the_other_side(staged: Staged) -> None:
    sides, index = exchange_sides(staged), until(staged, "put_into")
    tape, box = staged.episode.stages[index].primitive[1:3]
    staged.fill(tape, sides[box])


@case("wrong_count", "PickXtimes")
def a_misplaced_release_does_not_excuse_two_missing_ones(staged: Staged) -> None:
    stages = staged.episode.stages
    need(len(stages) >= 7)
    target = first_pick(staged)
    staged.lift(target).drop(target).press()


@case("wrong_object", "BinFill")
def the_other_color_came_before_the_misplaced_release(staged: Staged) -> None:
    stages = staged.episode.stages
    need(unwanted(staged) and len(stages) >= 7)
    wrong, target = unwanted(staged)[0], stages[0].primitive.subject
    staged.lift(wrong).fill(wrong, "bin").lift(target).drop(target).press()
