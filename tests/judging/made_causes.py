"""Causes of failures, the half by which the rules of attribution were made.

``python tests/judging/made_causes.py`` plays them and stores what happened, some twenty minutes.
"""

from __future__ import annotations

import math
import sys
from pathlib import Path

from cause_making import (
    CAUSES,
    OPEN,
    cause,
    need,
    play_causes,
    write_courses,
)

from roboirg.core.episode import Goal, Primitive
from roboirg.core.motions import Shuttle

MADE = Path(__file__).with_name("made_failures.jsonl.xz")
MISS = 0.035
PICKING = ("PickXtimes", "SwingXtimes", "VideoRepick", "VideoPlaceButton", "VideoPlaceOrder")
UNMASK = ("VideoUnmask", "ButtonUnmask", "VideoUnmaskSwap", "ButtonUnmaskSwap")
WITH_WRONG = (*PICKING, *UNMASK, "BinFill", "PickByCount")
ALL = (*WITH_WRONG, "PutInBox", "StopCube")


def first_pick(hands):
    """Play up to the first pick; its index."""
    index = hands.picks()[0]
    hands.play(hands.stages[:index])
    return index


def wrong_thing(hands, name):
    """An object of the same kind that is not meant, not the nearest one."""
    meant = {stage.primitive.subject for stage in hands.stages}
    colors = set() if hands.episode.task != "BinFill" else set(hands.episode.goal.texts("colors"))
    scene = hands.episode.scene
    wrong = [
        thing
        for thing in hands.others(name)
        if thing not in meant and scene[thing].color not in colors
    ]
    # An object in whose surroundings the right one lies cannot show what was meant.
    wrong = [thing for thing in wrong if math.dist(hands.at(thing), hands.at(name)) > 0.11]
    need(wrong)
    return wrong[0]


# Another goal, hands perfect


def another_goal(
    name,
    failure,
    tasks,
    *same,
    by=0,
    fits=lambda _goal, _meant: True,
):
    """Mark as a cause a goal that agrees in some slots, has so many more repeats, and fits."""

    def play(hands):
        meant = hands.episode.goal
        found = list(hands.other_goals)
        for slot in same:
            found = [goal for goal in found if goal[slot] == meant[slot]]
        if by:
            repeats = meant.number("repeats") + by
            found = [goal for goal in found if goal.number("repeats") == repeats]
        found = [goal for goal in found if fits(goal, meant)]
        need(found)
        hands.play(hands.stages_of(found[int(hands.rng.integers(len(found)))]))

    play.__name__ = name
    cause("grounding", failure, *tasks)(play)


def colors(goal):
    return goal.texts("colors")


COUNTED = ("PickXtimes", "SwingXtimes", "PickByCount")
another_goal("another_color", "wrong_object", ("PickXtimes", "SwingXtimes"), "repeats")
another_goal("another_color_to_place", "wrong_object", ("VideoPlaceButton",), "relation")
another_goal("another_color_to_order", "wrong_object", ("VideoPlaceOrder",), "placement")
another_goal("once_more", "wrong_count", COUNTED, "color", by=1)
another_goal("once_less", "wrong_count", COUNTED, "color", by=-1)
another_goal("repicked_once_more", "wrong_count", ("VideoRepick",), by=1)
another_goal("repicked_once_less", "wrong_count", ("VideoRepick",), by=-1)
another_goal("another_number_to_bin", "wrong_count", ("BinFill",), "colors")
another_goal("another_disc", "wrong_place", ("VideoPlaceButton", "VideoPlaceOrder"), "color")
another_goal("another_box", "wrong_place", ("PutInBox",))


another_goal(
    "another_color_to_bin",
    "wrong_object",
    ("BinFill",),
    fits=lambda goal, meant: (
        bool(set(colors(goal)) - set(colors(meant)))
        and sum(goal.numbers("counts")) == sum(meant.numbers("counts"))
    ),
)
another_goal(
    "another_container",
    "wrong_object",
    UNMASK,
    fits=lambda goal, meant: (
        len(colors(goal)) == len(colors(meant)) and colors(goal)[0] not in colors(meant)
    ),
)
another_goal(
    "the_two_the_other_way_round",
    "wrong_order",
    UNMASK,
    fits=lambda goal, meant: len(colors(goal)) > 1 and colors(goal) == colors(meant)[::-1],
)
another_goal(
    "only_the_first_of_two",
    "wrong_count",
    UNMASK,
    fits=lambda goal, meant: colors(goal) == colors(meant)[:1],
)


@cause("grounding", "wrong_order", "SwingXtimes")
def left_first(hands):
    pick, right, left, *rest = hands.stages
    hands.play([pick, left, right, *rest])


@cause("grounding", "wrong_order", "ButtonUnmask")
def container_before_the_button(hands):
    index = hands.picks()[0]
    container = hands.stages[index].primitive.subject
    hands.wait(60)
    hands.do(hands.stages[index])
    hands.do(Primitive("put_down", container))
    hands.play(hands.stages[:index])


@cause("grounding", "wrong_place", "VideoPlaceOrder")
def back_where_it_lay(hands):
    pick = hands.stages[0]
    hands.do(pick)
    hands.do(Primitive("place_on", pick.primitive.subject, "site"))


@cause("grounding", "wrong_place", "VideoPlaceOrder", "VideoPlaceButton", "PickXtimes", "BinFill")
def sets_it_on_another_cube(hands):
    hands.do(hands.stages[0])
    x, y, _ = hands.at(wrong_thing(hands, hands.stages[0].primitive.subject))
    hands.go((x, y, 0.15))
    hands.go((x, y, 0.062))
    hands.grip(OPEN)
    hands.go((x, y, 0.12))


@cause("grounding", "wrong_object", *PICKING, "VideoUnmask", "PickByCount")
def stays_above_a_wrong_thing(hands):
    index = first_pick(hands)
    x, y, _ = hands.at(wrong_thing(hands, hands.stages[index].primitive.subject))
    hands.go((x, y, 0.2))


# Wrong and clumsy


@cause("grounding", "wrong_object", *WITH_WRONG)
def snatches_at_a_wrong_thing(hands):
    index = first_pick(hands)
    hands.snatch(wrong_thing(hands, hands.stages[index].primitive.subject), 6)


@cause("grounding", "wrong_object", "PickXtimes", "SwingXtimes", "VideoRepick", "BinFill")
def snatches_at_a_wrong_thing_and_presses(hands):
    index = first_pick(hands)
    hands.snatch(wrong_thing(hands, hands.stages[index].primitive.subject), 6)
    hands.do(hands.stages[-1])


# Right and clumsy


@cause("execution", "missed_grasp", *WITH_WRONG, "PutInBox")
def snatches_at_the_right_thing(hands):
    index = first_pick(hands)
    hands.snatch(hands.stages[index].primitive.subject, 6)


def beside(
    name,
    failure,
    tasks,
    distance,
    chosen,
):
    """Mark as a cause that some stages are done beside, m, and the rest as if nothing was.

    `chosen` gets the indices of the stages that pick; where it chooses none, the scene does not
    offer the cause.
    """

    def play(hands):
        numbers = chosen(hands, hands.picks())
        need(numbers)
        for number, stage in enumerate(hands.stages):
            hands.do(stage, beside=distance if number in numbers else 0.0)

    play.__name__ = name
    cause("execution", failure, *tasks)(play)


SEVERAL = ("PickXtimes", "BinFill", "VideoRepick")
beside(
    "misses_the_only_one_and_goes_on",
    "missed_grasp",
    ("PickXtimes", "SwingXtimes", "VideoRepick"),
    MISS,
    lambda _, picks: picks if len(picks) == 1 else [],
)
beside(
    "misses_the_first_of_several",
    "missed_grasp",
    SEVERAL,
    MISS,
    lambda _, picks: picks[:1] if len(picks) >= 2 else [],
)
beside(
    "misses_the_last_of_several",
    "missed_grasp",
    SEVERAL,
    MISS,
    lambda _, picks: picks[1:][-1:],
)
beside(
    "misses_all_of_several",
    "missed_grasp",
    ("PickXtimes", "BinFill"),
    MISS,
    lambda _, picks: picks if len(picks) >= 2 else [],
)
beside(
    "misses_the_first_of_two",
    "missed_grasp",
    (*UNMASK, "PickByCount"),
    MISS,
    lambda _, picks: picks[:1] if len(picks) == 2 else [],
)
beside(
    "puts_one_beside",
    "misplaced",
    ("PickXtimes", "BinFill"),
    0.075,
    lambda _, picks: [picks[0] + 1] if len(picks) >= 2 else [],
)
beside(
    "the_last_visit_passes_beside",
    "misplaced",
    ("SwingXtimes",),
    0.05,
    lambda hands, _: [len(hands.stages) - 3],
)
beside(
    "presses_beside_the_button",
    "missed_press",
    ("ButtonUnmask", "ButtonUnmaskSwap"),
    0.05,
    lambda hands, _: [n for n, stage in enumerate(hands.stages) if stage.primitive.kind == "press"],
)


beside(
    "misses_one_in_the_middle",
    "missed_grasp",
    SEVERAL,
    MISS,
    lambda _, picks: picks[1:-1][:1],
)
beside(
    "a_swing_in_the_middle_passes_beside",
    "misplaced",
    ("SwingXtimes",),
    0.055,
    lambda hands, _: [3] if len(hands.stages) > 6 else [],
)
beside("the_first_visit_passes_beside", "misplaced", ("SwingXtimes",), 0.055, lambda *_: [1])


@cause("execution", "missed_grasp", "PickXtimes")
def the_first_slips_at_once(hands):
    need(len(hands.picks()) >= 2)
    pick, *rest = hands.stages
    hands.do(pick, until=5 / 6)
    x, y, _ = hands.at(pick.primitive.subject)
    hands.go((x, y, 0.03))
    hands.grip(OPEN)
    hands.go((x, y, 0.15))
    hands.play(rest)


@cause("execution", "dropped", "PickXtimes", "VideoPlaceOrder", "SwingXtimes")
def opens_half_way(hands):
    pick, place, *rest = hands.stages
    hands.do(pick)
    about = hands.at(str(place.primitive.place))
    x, y, _ = hands.at(pick.primitive.subject)
    hands.go(((x + about.x) / 2, (y + about.y) / 2, 0.15))
    hands.grip(OPEN)
    hands.play([place, *rest])


@cause("execution", "missed_press", "StopCube")
def presses_beside_in_time(hands):
    *waits, press = hands.stages
    hands.play(waits)
    hands.do(press, beside=0.045)


def press_at(hands, late):
    run = next(motion for motion in hands.episode.scene.motions if isinstance(motion, Shuttle))
    need(abs(late) < run.interval / 2 - 6)
    press = hands.stages[-1].primitive
    hands.do(hands.stages[0])
    moment = press.steps + late
    hands.wait(max(1, moment - 40 - hands.step))
    hands.do(Primitive("press_below", press.subject, steps=moment))


@cause("execution", "mistimed", "StopCube")
def presses_early(hands):
    press_at(hands, -40)


@cause("execution", "mistimed", "StopCube")
def presses_late(hands):
    press_at(hands, 45)


@cause("execution", "out_of_time", "PickXtimes", "BinFill", "VideoPlaceOrder", time=700)
def five_times_slower(hands):
    hands.slower = 5
    hands.play(hands.stages)


@cause("execution", "out_of_time", "VideoUnmask", "PutInBox", time=350)
def five_times_slower_and_less_time(hands):
    hands.slower = 5
    hands.play(hands.stages)


# Neither, and what acts do not show


@cause("success", None, "PickXtimes")
def hovers_over_a_wrong_one(hands):
    x, y, _ = hands.at(wrong_thing(hands, hands.stages[0].primitive.subject))
    hands.go((x, y, 0.1))
    hands.play(hands.stages)


@cause("unscored", "missed_grasp", "PickXtimes")
def takes_the_nearest_of_another_kind(hands):
    pick, *rest = hands.stages
    near = hands.others(pick.primitive.subject)
    need(near)
    hands.do(Primitive("pick_cube", near[0]))
    hands.play(rest)


@cause("undecided", "no_attempt", *ALL)
def does_nothing(hands):
    hands.wait(100)


@cause("undecided", "no_attempt", "StopCube", "PickXtimes", "VideoUnmask")
def trembles(hands):
    while True:
        hands.tremble(50)


@cause("undecided", "stopped", "StopCube", "PickXtimes")
def stays_above_the_button(hands):
    button = hands.stages[-1].primitive.subject if hands.episode.task != "StopCube" else "button"
    hands.do(Primitive("hover", button))


@cause("undecided", "stopped", "PickXtimes", "VideoRepick", "BinFill")
def never_presses(hands):
    hands.play(hands.stages[:-1])


@cause("undecided", "stopped", "PickXtimes", "VideoPlaceButton")
def stops_half_way(hands):
    hands.do(hands.stages[0])


# A listener


@cause("grounding", "misunderstood", "PickXtimes")
def understands_what_the_scene_cannot_have(hands):
    hands.declare({"color": "purple", "repeats": 2}, impossible=True)


@cause("undecided", "no_answer", "PickXtimes", "VideoUnmask")
def answers_nothing(hands):
    hands.declare(None)


@cause("grounding", "misunderstood", "PickXtimes", "VideoUnmask")
def understands_another_goal(hands):
    goal = hands.other_goals[-1]
    hands.declare(goal)
    hands.play(hands.stages_of(goal))


@cause("grounding", "misunderstood", "VideoUnmask")
def understands_a_part(hands):
    first, *rest = hands.episode.goal.texts("colors")
    need(rest)
    goal = Goal.of(colors=(first,))
    hands.declare(goal)
    hands.play(hands.stages_of(goal))


@cause("execution", "missed_grasp", "PickXtimes")
def understands_and_misses(hands):
    hands.declare(hands.episode.goal)
    hands.snatch(hands.stages[0].primitive.subject, 3)


def main():
    courses = []
    for course in play_causes(CAUSES, range(4, 50), 3):
        courses.append(course)
        sys.stderr.write(f"{course.cause} {course.where} {course.status} {course.words}\n")
    write_courses(MADE, courses)


if __name__ == "__main__":
    main()
