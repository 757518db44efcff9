"""The held-back causes of failures, written without a look at the rules that attribute failures.

Each is a way in which a learned policy, a listener or a planner fails, played with
`cause_making.Hands`; the courses lie in ``held_back_failures.jsonl.xz``. Names end in ``_clumsy``
where a wrong thing is tried with failing hands, and begin with ``unscored_`` where the acts cannot
show what was made, with ``control_`` where the episode succeeds. Scenes are those of the split
``val``.
"""

from __future__ import annotations

import math
import zlib
from collections.abc import Iterator, Sequence

from cause_making import CAUSES, CLOSED, OPEN, Cause, Course, Hands, cause, need, play_causes

from roboirg.core.episode import Goal, Primitive, Stage
from roboirg.core.motions import Point, Shuttle, Swap

SPLIT = "val"
EPISODES = 50
SWAPS_OVER = 225
"""Step at which all containers of ButtonUnmaskSwap stand still again."""
APART = 0.12
"""Distance at which a miss of one thing is no miss of another one, m."""

# What the causes are made of


def between(hands: Hands, low: float, high: float) -> float:
    """Draw a number."""
    return float(hands.rng.uniform(low, high))


def some(hands: Hands, low: int, high: int) -> int:
    """Draw how many times, both bounds included."""
    return int(hands.rng.integers(low, high + 1))


def tool(hands: Hands) -> Point:
    """Return where the tool is."""
    return Point(*(float(one) for one in hands.env.session.world.robot.tool_pose.p))


def rise(hands: Hands, height: float) -> None:
    """Go straight up, or down, to a height."""
    hands.go(tool(hands)._replace(z=height))


def pick_of(hands: Hands, name: str) -> Primitive:
    """Return how a thing is picked."""
    kind = hands.episode.scene[name].kind
    return Primitive("pick_container" if kind == "container" else "pick_cube", name)


def after_presses(hands: Hands) -> list[Stage]:
    """Press what is to be pressed first, wait for containers, and return the other stages."""
    stages = list(hands.stages)
    while stages[0].primitive.kind == "press":
        hands.do(stages.pop(0))
    wait_for_containers(hands)
    return stages


def wait_for_containers(hands: Hands) -> None:
    """Wait until the containers stand, and stand still."""
    until = {"ButtonUnmask": 40, "ButtonUnmaskSwap": SWAPS_OVER}.get(hands.episode.task, 0)
    if until > hands.step:
        hands.wait(until - hands.step)


def rounds(hands: Hands) -> tuple[list[Stage], list[list[Stage]], list[Stage]]:
    """Return the stages before the rounds that the goal counts, the rounds, and those after."""
    stages = list(hands.stages)
    first = 1 if hands.episode.task == "SwingXtimes" else 0
    tail = 2 if hands.episode.task == "SwingXtimes" else 1
    middle = stages[first:-tail]
    pairs = [middle[i : i + 2] for i in range(0, len(middle), 2)]
    return stages[:first], pairs, stages[-tail:]


def far_others(hands: Hands, name: str) -> list[str]:
    """Return the other things of the kind that stand well apart from one, the nearest first."""
    far = [one for one in hands.others(name) if math.dist(hands.at(one), hands.at(name)) > APART]
    need(far)
    return far


def other_discs(hands: Hands, name: str) -> list[str]:
    """Return the other discs, or boxes, the nearest first."""
    kind = hands.episode.scene[name].kind
    names = [one.name for one in hands.episode.scene.of_kind(kind) if one.name != name]
    need(names)
    return sorted(names, key=lambda one: math.dist(hands.at(one), hands.at(name)))


def no_other_disc_near(hands: Hands, name: str) -> None:
    """Refuse a scene in which what lies next to a place may lie on another one."""
    discs = [one.name for one in hands.episode.scene.of_kind("target") if one.name != name]
    need(all(math.dist(hands.at(one)[:2], hands.at(name)[:2]) > 0.14 for one in discs))


def goals_with(hands: Hands, same: Sequence[str], differing: Sequence[str]) -> list[Goal]:
    """Return the other goals whose slots are the same, or differ."""
    goal = hands.episode.goal
    found = [
        one
        for one in hands.other_goals
        if all(one[slot] == goal[slot] for slot in same)
        and all(one[slot] != goal[slot] for slot in differing)
    ]
    need(found)
    return found


def one_of(hands: Hands, choices: Sequence[Goal]) -> Goal:
    """Draw a goal."""
    return choices[some(hands, 0, len(choices) - 1)]


def not_taken(hands: Hands, name: str) -> None:
    """Refuse a scene in which a failing grasp took hold after all."""
    need(not any(hands.holds(kind, name) for kind in ("held", "picked", "lifted")))


def look_at(hands: Hands, name: str, height: float = 0.2) -> None:
    """Hold the hand above a thing for a moment."""
    x, y, _ = hands.at(name)
    hands.go((x, y, height))
    hands.wait(some(hands, 3, 15))


def carry(hands: Hands, place: str, share: float, height: float = 0.15) -> None:
    """Go a share of the straight way from here to above a place."""
    (x, y, _), (to_x, to_y, _) = tool(hands), hands.at(place)
    hands.go((x + share * (to_x - x), y + share * (to_y - y), height))


def pieces_of(hands: Hands, name: str) -> tuple[Point, float]:
    """Return where a thing is, and the height at which the fingers enclose it."""
    place = hands.at(name)
    container = hands.episode.scene[name].kind == "container"
    return place, place.z + 0.01 if container else place.z


def clear_of_places(hands: Hands, name: str) -> None:
    """Refuse a scene in which a thing that was let go lies at a place."""
    places = [
        one.name for kind in ("target", "bin", "box") for one in hands.episode.scene.of_kind(kind)
    ]
    gaps = [math.dist(hands.at(name)[:2], hands.at(one)[:2]) for one in places]
    need(all(gap > 0.055 for gap in gaps))


def press_at(hands: Hands, visit: int, share: float = 0.0) -> Primitive:
    """Return a press in the middle of a visit, or a share of a pass later."""
    motions = hands.episode.scene.motions
    interval = next(one.interval for one in motions if isinstance(one, Shuttle))
    steps = round(interval * (visit - 0.5 + share))
    need(steps > hands.step + 35)
    return Primitive("press_below", "button", steps=steps)


# A wrong thing


@cause(
    "grounding", "wrong_object", "PickXtimes", "SwingXtimes", "PickByCount", "VideoPlaceButton",
    time=700,
)  # fmt: skip
def serves_another_color(hands: Hands) -> None:
    """The whole plan, for a thing of another color."""
    same = [slot for slot, _ in hands.episode.goal.slots if slot != "color"]
    hands.play(hands.stages_of(one_of(hands, goals_with(hands, same, ["color"]))))


@cause(
    "grounding", "wrong_object", "VideoUnmask", "VideoRepick", "SwingXtimes", "ButtonUnmask",
    time=600,
)  # fmt: skip
def takes_the_one_on_the_other_side(hands: Hands) -> None:
    """Left for right: what stands nearest to the mirrored place."""
    name = after_presses(hands)[0].primitive.subject
    x, y, _ = hands.at(name)
    need(abs(y) > 0.04)
    others = [one for one in hands.others(name) if hands.at(one)[1] * y < 0]
    need(others)
    mirrored = min(others, key=lambda one: math.dist(hands.at(one)[:2], (x, -y)))
    hands.do(pick_of(hands, mirrored))
    hands.do(Primitive("put_down", mirrored, height=0.02))


@cause("grounding", "wrong_object", "VideoUnmaskSwap", "ButtonUnmaskSwap", "VideoRepick", time=700)
def takes_what_stands_there_now(hands: Hands) -> None:
    """It did not notice that things changed places."""
    name = after_presses(hands)[0].primitive.subject
    before = hands.episode.scene[name].position
    now = [name, *hands.others(name)]
    there = min(now, key=lambda one: math.dist(hands.at(one)[:2], before[:2]))
    need(there != name)
    hands.do(pick_of(hands, there))


@cause("grounding", "wrong_object", "PickXtimes", "VideoRepick", "PickByCount")
def right_once_then_another_one(hands: Hands) -> None:
    """One round, or more, as it should be; in the next it takes another thing."""
    _, pairs, _ = rounds(hands)
    need(len(pairs) > 1)
    for pair in pairs[: some(hands, 1, len(pairs) - 1)]:
        hands.play(pair)
    name = pairs[0][0].primitive.subject
    others = hands.others(name)
    need(others)
    hands.do(pick_of(hands, others[-1]))
    hands.do(pairs[0][1])


@cause("grounding", "wrong_object", "BinFill")
def throws_in_a_color_that_was_not_named(hands: Hands) -> None:
    """As many cubes as were asked for, the last of a color that was not named."""
    _, pairs, tail = rounds(hands)
    named = hands.episode.goal.texts("colors")
    cubes = [one.name for one in hands.episode.scene.of_kind("cube") if one.color not in named]
    for pair in pairs[:-1]:
        hands.play(pair)
    there = [one for one in cubes if one not in hands.env.session.world.absent]
    need(there)
    wrong = there[some(hands, 0, len(there) - 1)]
    hands.do(pick_of(hands, wrong))
    hands.do(Primitive("drop_into", wrong, "bin"))
    hands.play(tail)


@cause(
    "grounding", "wrong_object", "VideoUnmaskSwap", "SwingXtimes", "VideoRepick", "PickByCount",
    "ButtonUnmaskSwap", time=700,
)  # fmt: skip
def hovers_over_it_and_takes_another(hands: Hands) -> None:
    """The hand stops above the right thing, turns away and takes another one."""
    name = after_presses(hands)[0].primitive.subject
    others = hands.others(name)
    need(others)
    look_at(hands, name, between(hands, 0.17, 0.25))
    hands.do(pick_of(hands, others[some(hands, 0, len(others) - 1)]))


# A wrong number


@cause("grounding", "wrong_count", "PickXtimes", "BinFill", "VideoRepick", "SwingXtimes")
def ends_one_round_early(hands: Hands) -> None:
    """One round less than was asked for, then the end of the task."""
    head, pairs, tail = rounds(hands)
    need(len(pairs) > 1)
    hands.play([*head, *(stage for pair in pairs[:-1] for stage in pair), *tail])


@cause("grounding", "wrong_count", "PickXtimes", "VideoRepick", "PickByCount", "SwingXtimes")
def goes_one_round_too_far(hands: Hands) -> None:
    """One round more than was asked for."""
    head, pairs, tail = rounds(hands)
    hands.play([*head, *(stage for pair in pairs for stage in pair), *pairs[-1], *tail])


@cause("grounding", "wrong_count", "PickXtimes", "BinFill", "SwingXtimes")
def hears_another_number(hands: Hands) -> None:
    """The right things, another number of times."""
    slots = {"BinFill": ("colors", "counts")}.get(hands.episode.task, ("color", "repeats"))
    hands.play(hands.stages_of(one_of(hands, goals_with(hands, slots[:1], slots[1:]))))


@cause("grounding", "wrong_count", "BinFill")
def exchanges_the_numbers_of_two_colors(hands: Hands) -> None:
    """As many cubes in all, but too many of one color and too few of another one."""
    total = sum(hands.episode.goal.numbers("counts"))
    goals = goals_with(hands, ["colors"], ["counts"])
    goals = [one for one in goals if sum(one.numbers("counts")) == total]
    need(goals)
    hands.play(hands.stages_of(one_of(hands, goals)))


# A wrong order


@cause(
    "grounding", "wrong_order", "VideoUnmask", "ButtonUnmask", "VideoUnmaskSwap",
    "ButtonUnmaskSwap", time=800,
)  # fmt: skip
def lifts_the_second_one_first(hands: Hands) -> None:
    """Both containers are known, their order is not."""
    colors = hands.episode.goal.texts("colors")
    need(len(colors) > 1)
    after_presses(hands)
    stages = hands.stages_of(Goal.of(colors=colors[::-1]))
    hands.play(one for one in stages if one.primitive.kind != "press")


@cause("grounding", "wrong_order", "SwingXtimes")
def begins_on_the_left(hands: Hands) -> None:
    """Each swing from the left to the right."""
    head, pairs, tail = rounds(hands)
    hands.play([*head, *(stage for pair in pairs for stage in reversed(pair)), *tail])


@cause("grounding", "wrong_order", "SwingXtimes")
def all_right_ones_then_all_left_ones(hands: Hands) -> None:
    """N times over the right target, N times over the left one; it draws back in between."""
    head, pairs, tail = rounds(hands)
    need(len(pairs) > 1)
    hands.play(head)
    for side in (0, 1):
        for pair in pairs:
            hands.do(pair[side])
            x, y, z = tool(hands)
            hands.go((x - between(hands, 0.07, 0.1), y, z + 0.05))
    hands.play(tail)


@cause("grounding", "wrong_order", "ButtonUnmask", "ButtonUnmaskSwap", time=600)
def lifts_before_it_presses(hands: Hands) -> None:
    """The container first; the button is forgotten, or comes after it."""
    wait_for_containers(hands)
    presses = [one for one in hands.stages if one.primitive.kind == "press"]
    lift = next(one for one in hands.stages if one.primitive.kind == "pick_container")
    hands.do(lift)
    hands.do(Primitive("put_down", lift.primitive.subject))
    hands.play(presses[: some(hands, 0, len(presses))])


@cause("grounding", "wrong_order", "VideoUnmask", "VideoUnmaskSwap", time=500)
def looks_at_the_first_and_lifts_the_second(hands: Hands) -> None:
    """It stops above the first container, goes on to the second and lifts that."""
    picks = [hands.stages[i].primitive.subject for i in hands.picks()]
    need(len(picks) > 1)
    look_at(hands, picks[0], between(hands, 0.18, 0.25))
    hands.do(pick_of(hands, picks[1]))


# A wrong place


@cause("grounding", "wrong_place", "VideoPlaceButton", "VideoPlaceOrder", time=500)
def puts_it_on_the_next_disc(hands: Hands) -> None:
    """The right cube, on the disc that lies nearest to the right one."""
    pick, place = hands.stages
    hands.do(pick)
    wrong = other_discs(hands, str(place.primitive.place))[0]
    hands.do(place.primitive._replace(place=wrong))


@cause("grounding", "wrong_place", "VideoPlaceButton", "VideoPlaceOrder", time=500)
def remembers_another_placing(hands: Hands) -> None:
    """After for before, the second for the third."""
    (slot,) = (name for name, _ in hands.episode.goal.slots if name != "color")
    hands.play(hands.stages_of(one_of(hands, goals_with(hands, ["color"], [slot]))))


@cause("grounding", "wrong_place", "PutInBox", time=500)
def takes_the_other_box(hands: Hands) -> None:
    """The tape goes straight into the other box."""
    pick, put = hands.stages
    hands.do(pick)
    hands.do(put.primitive._replace(place=other_discs(hands, str(put.primitive.place))[0]))


@cause("grounding", "wrong_place", "PutInBox", "VideoPlaceOrder", "VideoPlaceButton", time=600)
def stops_over_the_place_and_takes_another(hands: Hands) -> None:
    """It carries the thing to above its place, waits there, and puts it down at another one."""
    pick, put = hands.stages
    hands.do(pick)
    place = str(put.primitive.place)
    carry(hands, place, 1.0, between(hands, 0.15, 0.2))
    hands.wait(some(hands, 3, 20))
    others = other_discs(hands, place)
    hands.do(put.primitive._replace(place=others[some(hands, 0, len(others) - 1)]))


@cause("grounding", "wrong_place", "VideoPlaceButton", "VideoPlaceOrder", time=500)
def puts_it_where_the_disc_was(hands: Hands) -> None:
    """It did not notice that two discs changed places."""
    pick, put = hands.stages
    place = str(put.primitive.place)
    need(any(isinstance(one, Swap) for one in hands.episode.scene.motions))
    before = hands.episode.scene[place].position
    discs = [place, *other_discs(hands, place)]
    there = min(discs, key=lambda one: math.dist(hands.at(one)[:2], before[:2]))
    need(there != place)
    hands.do(pick)
    hands.do(put.primitive._replace(place=there))


# A wrong visit


@cause("grounding", "wrong_time", "StopCube", time=700)
def stops_it_one_visit_early(hands: Hands) -> None:
    """A press in the middle of the visit before, to within some steps."""
    hands.do(hands.stages[0])
    visit = hands.episode.goal.number("visit") - 1
    hands.do(press_at(hands, visit, between(hands, -0.04, 0.04)))


@cause("grounding", "wrong_time", "StopCube", time=700)
def stops_it_two_or_three_visits_early(hands: Hands) -> None:
    """It is too eager, and comes slowly down to the button."""
    visit = hands.episode.goal.number("visit")
    need(visit > 3)
    hands.do(hands.stages[0])
    hands.wait(some(hands, 1, 10))
    hands.do(press_at(hands, some(hands, 2, visit - 2), between(hands, -0.03, 0.03)))


@cause("grounding", None, "SwingXtimes")
def swings_over_the_right_disc_only(hands: Hands) -> None:
    """Over the right target and back, where the left one is due."""
    head, pairs, tail = rounds(hands)
    hands.play(head)
    for pair in pairs:
        for _ in pair:
            hands.do(pair[0])
            x, y, z = tool(hands)
            hands.go((x - between(hands, 0.07, 0.1), y + between(hands, 0.0, 0.03), z + 0.06))
    hands.play(tail)


@cause("grounding", None, "SwingXtimes")
def visits_the_right_disc_twice(hands: Hands) -> None:
    """Right, right again, then left: one visit more than there should be, of the wrong disc."""
    head, pairs, tail = rounds(hands)
    hands.play(head)
    hands.do(pairs[0][0])
    x, y, z = tool(hands)
    hands.go((x - between(hands, 0.07, 0.1), y, z + 0.05))
    hands.play([stage for pair in pairs for stage in pair])
    hands.play(tail)


# Wrong, and clumsy


@cause(
    "grounding", "wrong_object", "PickXtimes", "VideoRepick", "VideoUnmask", "PickByCount",
    "SwingXtimes", time=700,
)  # fmt: skip
def snatches_at_another_one_clumsy(hands: Hands) -> None:
    """Fingers that close beside a wrong thing, once or up to six times."""
    wrong = far_others(hands, hands.stages[0].primitive.subject)[0]
    for _ in range(some(hands, 1, 6)):
        hands.snatch(wrong, 1, between(hands, 0.035, 0.055))
        not_taken(hands, wrong)


@cause(
    "grounding", "wrong_object", "VideoUnmask", "ButtonUnmask", "VideoUnmaskSwap",
    "ButtonUnmaskSwap", time=600,
)  # fmt: skip
def raises_another_container_and_loses_it_clumsy(hands: Hands) -> None:
    """A wrong container slips out of the hand before it is lifted."""
    wrong = far_others(hands, after_presses(hands)[0].primitive.subject)[0]
    hands.do(pick_of(hands, wrong), until=0.8)
    rise(hands, tool(hands).z + between(hands, 0.03, 0.06))
    hands.grip(OPEN)
    rise(hands, 0.25)


@cause("grounding", "wrong_place", "VideoPlaceButton", "VideoPlaceOrder", time=600)
def lets_go_next_to_a_wrong_disc_clumsy(hands: Hands) -> None:
    """Means a wrong disc, and misses that as well."""
    pick, put = hands.stages
    place = str(put.primitive.place)
    far = [
        one for one in other_discs(hands, place) if math.dist(hands.at(one), hands.at(place)) > 0.16
    ]
    need(far)
    hands.do(pick)
    hands.do(put.primitive._replace(place=far[0]), beside=between(hands, 0.058, 0.07))
    clear_of_places(hands, pick.primitive.subject)


@cause("grounding", "wrong_place", "PutInBox", time=500)
def throws_it_next_to_the_other_box_clumsy(hands: Hands) -> None:
    """Means the other box, and misses that as well."""
    pick, put = hands.stages
    hands.do(pick)
    wrong = other_discs(hands, str(put.primitive.place))[0]
    side = math.copysign(between(hands, 0.1, 0.115), hands.at(wrong).y)
    hands.do(put.primitive._replace(place=wrong), beside=(between(hands, -0.02, 0.02), side))


@cause("grounding", "wrong_time", "StopCube", time=700)
def hits_beside_the_button_a_visit_early_clumsy(hands: Hands) -> None:
    """The wrong visit, and the hand comes down beside the button."""
    size, turn = between(hands, 0.045, 0.065), between(hands, -1.2, 1.2)
    vector = (size * math.cos(turn), size * math.sin(turn))
    hands.do(hands.stages[0], beside=vector if some(hands, 0, 1) else 0.0)
    visit = some(hands, 2, max(2, hands.episode.goal.number("visit") - 1))
    need(visit < hands.episode.goal.number("visit"))
    hands.do(press_at(hands, visit, between(hands, -0.04, 0.04)), beside=vector)
    need(not hands.holds("stopped", "shuttle", "target"))


@cause(
    "grounding", "wrong_order", "VideoUnmask", "ButtonUnmask", "VideoUnmaskSwap",
    "ButtonUnmaskSwap", time=700,
)  # fmt: skip
def snatches_at_the_second_first_clumsy(hands: Hands) -> None:
    """The order is wrong, and the fingers close beside the container."""
    stages = after_presses(hands)
    need(len(stages) > 1)
    first, second = stages[0].primitive.subject, stages[-1].primitive.subject
    need(math.dist(hands.at(first), hands.at(second)) > APART)
    for _ in range(some(hands, 1, 5)):
        hands.snatch(second, 1, between(hands, 0.03, 0.05))
        not_taken(hands, second)


@cause("grounding", "wrong_count", "PickXtimes", "VideoRepick", "BinFill", "SwingXtimes", time=900)
def ends_early_beside_the_button_clumsy(hands: Hands) -> None:
    """A round too few; then the hand comes down beside the button, once or more."""
    head, pairs, tail = rounds(hands)
    need(len(pairs) > 1)
    hands.play([*head, *(stage for pair in pairs[:-1] for stage in pair), *tail[:-1]])
    size = between(hands, 0.045, 0.065)
    for _ in range(some(hands, 1, 4)):
        hands.do(tail[-1], beside=size)


# A grasp that misses


@cause(
    "execution", "missed_grasp", "PickXtimes", "VideoUnmask", "PutInBox", "VideoPlaceButton",
    "ButtonUnmaskSwap", time=800,
)  # fmt: skip
def closes_beside_it_and_gives_up(hands: Hands) -> None:
    """Fingers that close beside the right thing, once or up to six times; then it rests."""
    name = after_presses(hands)[0].primitive.subject
    for _ in range(some(hands, 1, 6)):
        hands.snatch(name, 1, between(hands, 0.025, 0.075))
        not_taken(hands, name)


@cause(
    "execution", "missed_grasp", "SwingXtimes", "PickByCount", "ButtonUnmask", "VideoPlaceOrder",
    time=600,
)  # fmt: skip
def closes_on_the_way_up(hands: Hands) -> None:
    """It comes down as it should, and closes the fingers too late."""
    name = after_presses(hands)[0].primitive.subject
    for _ in range(some(hands, 1, 4)):
        hands.do(pick_of(hands, name), until=0.6)
        hands.grip(OPEN)
        rise(hands, pieces_of(hands, name)[1] + between(hands, 0.045, 0.08))
        hands.grip(CLOSED)
        rise(hands, 0.22)
        not_taken(hands, name)


@cause("execution", "missed_grasp", "PickXtimes", "BinFill", "PutInBox", "VideoRepick", time=600)
def lets_it_slip_before_it_is_up(hands: Hands) -> None:
    """It takes hold, and the thing slips out near the table; once or up to three times."""
    name = hands.stages[0].primitive.subject
    for _ in range(some(hands, 1, 3)):
        hands.do(pick_of(hands, name), until=0.8)
        need(hands.holds("held", name))
        rise(hands, tool(hands).z + between(hands, 0.006, 0.018))
        hands.grip(OPEN)
        rise(hands, 0.15)


@cause(
    "execution", "missed_grasp", "PickXtimes", "VideoRepick", "VideoPlaceOrder", "PickByCount",
    time=900,
)  # fmt: skip
def goes_blindly_on_with_an_empty_hand(hands: Hands) -> None:
    """It does not notice that the hand is empty, in any round, and does all the rest."""
    for stage in hands.stages:
        if stage.primitive.kind == "pick_cube":
            hands.do(stage, beside=between(hands, 0.035, 0.06))
            not_taken(hands, stage.primitive.subject)
        else:
            hands.do(stage)


@cause(
    "execution", "missed_grasp", "VideoUnmaskSwap", "ButtonUnmask", "BinFill", "VideoPlaceButton",
    time=600,
)  # fmt: skip
def closes_too_high(hands: Hands) -> None:
    """The fingers close above the right thing, again and again or once."""
    name = after_presses(hands)[0].primitive.subject
    lowest = pieces_of(hands, name)[1] + between(hands, 0.035, 0.06)
    for _ in range(some(hands, 1, 5)):
        hands.do(pick_of(hands, name), lowest=lowest, until=1.0)
        not_taken(hands, name)
        rise(hands, 0.24)


@cause("execution", "missed_grasp", "SwingXtimes", "PickByCount", "VideoPlaceButton", time=600)
def shoves_it_away_and_closes_where_it_was(hands: Hands) -> None:
    """The hand pushes the thing aside, and closes on the place where it stood."""
    name = hands.stages[0].primitive.subject
    x, y, z = hands.at(name)
    hands.go((x - 0.06, y, 0.15))
    hands.grip(CLOSED)
    hands.go((x - 0.06, y, z))
    hands.go((x + between(hands, 0.015, 0.035), y, z))
    hands.go((x - 0.06, y, z + 0.06))
    hands.grip(OPEN)
    hands.go((x - between(hands, 0.005, 0.02), y, z))
    hands.grip(CLOSED)
    rise(hands, 0.16)
    not_taken(hands, name)


@cause("execution", "missed_grasp", "PickXtimes", "VideoRepick", "BinFill", "VideoUnmaskSwap")
def misses_in_a_later_round(hands: Hands) -> None:
    """The first act succeeds; the next grasps close beside, and it gives up after some."""
    picks = hands.picks()
    need(len(picks) > 1)
    hands.play(hands.stages[: picks[1]])
    name = hands.stages[picks[1]].primitive.subject
    for _ in range(some(hands, 2, 4)):
        hands.snatch(name, 1, between(hands, 0.035, 0.055))
        not_taken(hands, name)


@cause("execution", "missed_grasp", "PutInBox", "SwingXtimes", "VideoRepick", time=600)
def closes_on_the_way_down(hands: Hands) -> None:
    """The fingers are closed before they are around the thing, and land on it or just above."""
    name = hands.stages[0].primitive.subject
    for _ in range(some(hands, 1, 3)):
        x, y, z = hands.at(name)
        hands.go((x, y, 0.15))
        hands.grip(OPEN)
        hands.go((x, y, z + between(hands, 0.05, 0.08)))
        hands.grip(CLOSED)
        hands.go((x, y, z + between(hands, 0.022, 0.035)))
        rise(hands, 0.16)
        not_taken(hands, name)


# A press that misses


@cause(
    "execution", "missed_press", "PickXtimes", "BinFill", "VideoRepick", "SwingXtimes", time=1100
)
def presses_beside_it_at_the_end(hands: Hands) -> None:
    """All is done but for the press, which comes down beside the button; once or more."""
    hands.play(hands.stages[:-1])
    for _ in range(some(hands, 1, 4)):
        hands.do(hands.stages[-1], beside=between(hands, 0.042, 0.08))


@cause("execution", "missed_press", "ButtonUnmask", "ButtonUnmaskSwap", time=700)
def presses_beside_it_and_goes_on(hands: Hands) -> None:
    """The first press comes down beside the button; it does not notice, and does the rest."""
    first, *rest = hands.stages
    hands.do(first, beside=between(hands, 0.045, 0.06))
    need(not hands.holds("pressed", first.primitive.subject))
    hands.play(one for one in rest if one.primitive.kind == "press")
    wait_for_containers(hands)
    hands.play(one for one in rest if one.primitive.kind != "press")


@cause("execution", "missed_press", "ButtonUnmask", "VideoRepick", "SwingXtimes", time=900)
def presses_not_deep_enough(hands: Hands) -> None:
    """The closed hand comes down above the button and stops short of it."""
    press = next(one for one in hands.stages if one.primitive.kind == "press")
    hands.play(hands.stages[: hands.stages.index(press)])
    for _ in range(some(hands, 1, 4)):
        hands.do(press, lowest=between(hands, 0.045, 0.058))


@cause("execution", "missed_press", "StopCube", time=700)
def hits_beside_the_button_in_time(hands: Hands) -> None:
    """The right visit, but the hand comes down beside the button."""
    size, turn = between(hands, 0.045, 0.08), between(hands, -3.1, 3.1)
    vector = (size * math.cos(turn), size * math.sin(turn))
    hands.do(hands.stages[0], beside=vector if some(hands, 0, 1) else 0.0)
    press = press_at(hands, hands.episode.goal.number("visit"), between(hands, -0.05, 0.03))
    hands.do(press, beside=vector)


@cause("execution", "missed_press", "ButtonUnmaskSwap", time=700)
def presses_one_of_two_and_misses_the_other(hands: Hands) -> None:
    """One button is pressed; the other one is missed again and again."""
    first, second, *_ = hands.stages
    hands.do(first)
    for _ in range(some(hands, 1, 5)):
        hands.do(second, beside=between(hands, 0.045, 0.06))


# Something that is dropped


@cause(
    "execution", "dropped", "PickXtimes", "VideoPlaceOrder", "PutInBox", "PickByCount", "BinFill",
    time=700,
)  # fmt: skip
def loses_it_on_the_way(hands: Hands) -> None:
    """The fingers open on the way to the place; it does not notice, and goes on to there."""
    pick, put, *_ = hands.stages
    hands.do(pick)
    carry(hands, str(put.primitive.place), between(hands, 0.3, 0.7), between(hands, 0.11, 0.17))
    hands.grip(OPEN)
    hands.wait(10)
    clear_of_places(hands, pick.primitive.subject)
    hands.do(put)


@cause("execution", "dropped", "SwingXtimes", time=700)
def loses_it_in_the_swing(hands: Hands) -> None:
    """The cube falls between two targets; the empty hand swings on, or rests."""
    head, pairs, _ = rounds(hands)
    hands.play(head)
    swings = [stage for pair in pairs for stage in pair]
    done = some(hands, 0, len(swings) - 1)
    hands.play(swings[:done])
    place = str(swings[done].primitive.place)
    carry(hands, place, between(hands, 0.3, 0.65), between(hands, 0.09, 0.13))
    hands.grip(OPEN)
    hands.play(swings[done : done + some(hands, 0, 3)])


@cause(
    "execution", "dropped", "VideoPlaceButton", "PutInBox", "PickByCount", "PickXtimes", time=700
)
def lifts_it_and_loses_it_again_and_again(hands: Hands) -> None:
    """The thing falls out of the lifted hand, twice or more; then it gives up."""
    name = hands.stages[0].primitive.subject
    for _ in range(some(hands, 2, 4)):
        hands.do(hands.stages[0])
        need(hands.holds("picked", name))
        rise(hands, between(hands, 0.09, 0.15))
        hands.grip(OPEN)
        hands.wait(8)
        clear_of_places(hands, name)


@cause("execution", "dropped", "VideoPlaceButton", "PickByCount", "VideoPlaceOrder", time=600)
def opens_before_it_is_there(hands: Hands) -> None:
    """The fingers open 7 to 10 cm before the place, still high above the table."""
    pick, put, *_ = hands.stages
    hands.do(pick)
    place = str(put.primitive.place)
    way = math.dist(tool(hands)[:2], hands.at(place)[:2])
    left = between(hands, 0.07, 0.1)
    need(way > left + 0.04)
    carry(hands, place, 1 - left / way, between(hands, 0.09, 0.13))
    hands.grip(OPEN)
    hands.wait(10)
    clear_of_places(hands, pick.primitive.subject)
    rise(hands, 0.2)


# Something that is put down next to its place


@cause(
    "execution", "misplaced", "PickXtimes", "VideoPlaceButton", "VideoPlaceOrder", "PickByCount",
    time=700,
)  # fmt: skip
def sets_it_down_beside_the_place(hands: Hands) -> None:
    """The thing stands 6 to 8 cm beside the middle of its place; it goes away and rests."""
    pick, put, *_ = hands.stages
    no_other_disc_near(hands, str(put.primitive.place))
    hands.do(pick)
    hands.do(put, beside=between(hands, 0.058, 0.08))
    clear_of_places(hands, pick.primitive.subject)


@cause("execution", "misplaced", "BinFill", "PutInBox", time=700)
def throws_it_beside(hands: Hands) -> None:
    """The thing falls next to the bin or box, or on its rim."""
    pick, put, *_ = hands.stages
    hands.do(pick)
    low, high = (0.08, 0.1) if hands.episode.task == "BinFill" else (0.098, 0.115)
    hands.do(put, beside=between(hands, low, high))
    clear_of_places(hands, pick.primitive.subject)


@cause("execution", "misplaced", "SwingXtimes")
def swings_past_a_disc(hands: Hands) -> None:
    """One of the swings goes past its target, or several do; then the rest as it should be."""
    head, pairs, tail = rounds(hands)
    hands.play(head)
    swings = [stage for pair in pairs for stage in pair]
    first = some(hands, 0, len(swings) - 1)
    past = range(first, some(hands, first, len(swings) - 1) + 1)
    for number, swing in enumerate(swings):
        side = 1 if str(swing.primitive.place).endswith("left") else -1
        vector = (between(hands, -0.03, 0.0), -side * between(hands, 0.048, 0.075))
        hands.do(swing, beside=vector if number in past else 0.0)
    hands.play(tail)


@cause("execution", "misplaced", "PickXtimes", time=1100)
def sets_it_down_beside_and_goes_on(hands: Hands) -> None:
    """The last time the cube is put down beside the target; it does not notice, and presses."""
    *before, put, press = hands.stages
    hands.play(before)
    hands.do(put, beside=between(hands, 0.058, 0.075))
    clear_of_places(hands, put.primitive.subject)
    hands.do(press)


@cause("execution", "misplaced", "VideoPlaceButton", "VideoPlaceOrder", "PickByCount", time=900)
def stops_short_of_the_place_each_time(hands: Hands) -> None:
    """It puts the thing down short of its place, picks it up again, and again stops short."""
    pick, put, *_ = hands.stages
    place, name = str(put.primitive.place), pick.primitive.subject
    no_other_disc_near(hands, place)
    for _ in range(some(hands, 1, 3)):
        hands.do(pick)
        (x, y, _), (to_x, to_y, _) = tool(hands), hands.at(place)
        way, short = math.dist((x, y), (to_x, to_y)), between(hands, 0.06, 0.08)
        need(way > 0.05)
        hands.do(put, beside=(short * (x - to_x) / way, short * (y - to_y) / way))
        clear_of_places(hands, name)


# Pressed off the target


@cause("execution", "mistimed", "StopCube", time=700)
def stops_it_a_little_off_the_target(hands: Hands) -> None:
    """The right visit, a fifth of a pass or so too early or too late."""
    hands.do(hands.stages[0])
    off = between(hands, 0.13, 0.26) * (1 if hands.rng.integers(2) else -1)
    hands.do(press_at(hands, hands.episode.goal.number("visit"), off))


# Out of time


@cause("execution", "out_of_time", "PickXtimes", "VideoRepick", "BinFill", "SwingXtimes", time=600)
def does_everything_in_slow_motion(hands: Hands) -> None:
    """Right, but several times too slow."""
    hands.slower = some(hands, 4, 6)
    hands.play(hands.stages)


@cause(
    "execution", "out_of_time", "VideoUnmask", "ButtonUnmask", "PutInBox", "VideoPlaceOrder",
    time=250,
)  # fmt: skip
def creeps_to_the_first_thing(hands: Hands) -> None:
    """So slow that little is done."""
    hands.slower = some(hands, 5, 9)
    hands.play(hands.stages)


@cause(
    "execution", "out_of_time", "PickByCount", "VideoPlaceButton", "VideoUnmaskSwap",
    "ButtonUnmaskSwap", time=280,
)  # fmt: skip
def dithers_before_each_act(hands: Hands) -> None:
    """To and fro before each act, which it does slowly; never at rest for long."""
    hands.slower = 3
    for stage in hands.stages:
        about = str(stage.primitive.place or stage.primitive.subject)
        for _ in range(some(hands, 1, 2)):
            if about in hands.env.session.world.bodies:
                carry(hands, about, between(hands, 0.5, 0.7), between(hands, 0.2, 0.25))
                carry(hands, about, -between(hands, 0.3, 0.6), between(hands, 0.2, 0.25))
        hands.do(stage)


@cause(
    "execution", "out_of_time", "PickXtimes", "PutInBox", "VideoPlaceButton", "SwingXtimes",
    time=190,
)  # fmt: skip
def starts_late_and_is_cut_off(hands: Hands) -> None:
    """It hesitates before it starts; then all is right and quick, but time is up on the way."""
    hands.wait(some(hands, 20, 40))
    x, y, z = tool(hands)
    for way in (1, -1):
        hands.go((x + between(hands, 0.02, 0.05), y + way * between(hands, 0.02, 0.06), z))
    hands.play(hands.stages)


@cause("execution", "out_of_time", "StopCube", time=700)
def comes_too_late_to_the_button(hands: Hands) -> None:
    """The hand is still on its way when the visit is over."""
    motions = hands.episode.scene.motions
    interval = next(one.interval for one in motions if isinstance(one, Shuttle))
    over = interval * hands.episode.goal.number("visit")
    need(over < 420)
    hands.slower = math.ceil(over / 40)
    hands.play(hands.stages)


# Nothing, or nothing more


@cause(
    "undecided", "no_attempt", "StopCube", "PutInBox", "VideoUnmask", "PickXtimes", "SwingXtimes",
    time=400,
)  # fmt: skip
def never_moves(hands: Hands) -> None:
    """It rests all the time."""
    hands.wait(1)


@cause(
    "undecided", "no_attempt", "BinFill", "VideoRepick", "ButtonUnmaskSwap", "VideoPlaceOrder",
    time=300,
)  # fmt: skip
def trembles_all_the_time(hands: Hands) -> None:
    """Jitter about where it is."""
    hands.tremble(300, between(hands, 0.005, 0.03))


@cause("undecided", "no_attempt", "ButtonUnmask", "PickByCount", "VideoUnmaskSwap", time=400)
def waves_high_in_the_air(hands: Hands) -> None:
    """It moves about high above the middle of the table, and goes down to nothing."""
    while True:
        x, y = between(hands, -0.25, -0.1), between(hands, -0.05, 0.05)
        hands.go((x, y, between(hands, 0.35, 0.45)))


@cause("undecided", "stopped", "PickXtimes", "SwingXtimes", "VideoRepick", "BinFill", time=1100)
def never_presses(hands: Hands) -> None:
    """All is done but for the press; then it rests."""
    hands.play(hands.stages[:-1])


@cause("undecided", "stopped", "StopCube", time=700)
def rests_above_the_button(hands: Hands) -> None:
    """The hand waits above the button, and never presses."""
    hands.do(hands.stages[0])


@cause("undecided", "stopped", "PickByCount", "VideoUnmask", "ButtonUnmaskSwap", time=600)
def rests_with_half_of_it_done(hands: Hands) -> None:
    """The first of two is done; then it rests."""
    picks = hands.picks()
    need(len(picks) > 1)
    hands.play(hands.stages[: picks[1]])


# What a listener says


@cause("grounding", "misunderstood", "PickXtimes", "SwingXtimes", "PutInBox", time=700)
def understands_another_color_and_serves_it(hands: Hands) -> None:
    """A listener names another color, and the hands do what it said."""
    goal = one_of(hands, goals_with(hands, [], ["color"]))
    hands.declare(goal)
    hands.play(hands.stages_of(goal))


@cause(
    "grounding", "misunderstood", "VideoPlaceOrder", "PickByCount", "PickXtimes", "StopCube",
    time=600,
)  # fmt: skip
def understands_another_number_and_misses(hands: Hands) -> None:
    """A listener names another number; then the first grasp misses, or nothing comes of it."""
    (slot,) = (name for name, _ in hands.episode.goal.slots if name != "color")
    same = [name for name, _ in hands.episode.goal.slots if name == "color"]
    hands.declare(one_of(hands, goals_with(hands, same, [slot])))
    if hands.picks():
        hands.snatch(hands.stages[0].primitive.subject, some(hands, 1, 3), 0.045)


@cause("execution", "missed_grasp", "PickXtimes", "VideoPlaceButton", "PutInBox", time=500)
def understands_it_and_misses_it(hands: Hands) -> None:
    """A listener names what is meant; the fingers close beside it."""
    hands.declare(hands.episode.goal)
    name = hands.stages[0].primitive.subject
    for _ in range(some(hands, 1, 4)):
        hands.snatch(name, 1, between(hands, 0.035, 0.055))
        not_taken(hands, name)


@cause("undecided", "no_answer", "VideoUnmask", "BinFill", "VideoRepick", time=200)
def gives_no_answer(hands: Hands) -> None:
    """The reply of a listener holds no goal, and nothing is done."""
    hands.declare(None)


# What the acts cannot show


@cause("execution", None, "VideoRepick", "BinFill")
def unscored_takes_a_neighbor_by_bad_aim(hands: Hands) -> None:
    """It means the right thing, is off by the distance to a neighbor, and takes that."""
    first, *_ = hands.stages
    name = first.primitive.subject
    others = hands.others(name)
    need(others)
    near, right = hands.at(others[0]), hands.at(name)
    need(math.dist(near, right) < 0.1)
    hands.do(first, beside=(near.x - right.x, near.y - right.y))


@cause("execution", None, "PickXtimes", "BinFill", time=500)
def unscored_presses_by_accident(hands: Hands) -> None:
    """On the way to its place, what is in the hand comes down on the button."""
    first, *_ = hands.stages
    hands.do(first)
    hands.do(Primitive("place_on", first.primitive.subject, "button"))


@cause("execution", None, "SwingXtimes", time=1100)
def unscored_detour_over_the_left_disc(hands: Hands) -> None:
    """The way to the right target leads over the left one."""
    head, pairs, tail = rounds(hands)
    hands.play([*head, pairs[0][1], *(stage for pair in pairs for stage in pair), *tail])


@cause("execution", None, "PickXtimes", "PickByCount")
def unscored_places_again_what_had_counted(hands: Hands) -> None:
    """It takes a placing that had counted for a miss, and repeats it."""
    _, pairs, tail = rounds(hands)
    hands.play([stage for pair in pairs for stage in pair])
    hands.play([*pairs[-1], *tail])


@cause("undecided", None, "PickXtimes", "SwingXtimes", "VideoPlaceButton", time=600)
def unscored_puts_it_back_where_it_was(hands: Hands) -> None:
    """It picks the right thing up, hesitates, puts it back, and rests."""
    first, *_ = hands.stages
    hands.do(first)
    hands.wait(some(hands, 5, 30))
    hands.do(Primitive("put_down", first.primitive.subject, height=0.02))


# Controls


@cause("success", None, "PickXtimes", "VideoUnmask", "PutInBox", "VideoPlaceOrder")
def control_takes_it_at_the_third_try(hands: Hands) -> None:
    """Two grasps close beside; then all is done as it should be."""
    hands.snatch(hands.stages[0].primitive.subject, 2, between(hands, 0.035, 0.05))
    hands.play(hands.stages)


@cause("success", None, "BinFill", "SwingXtimes", "VideoRepick", "ButtonUnmask")
def control_takes_its_time(hands: Hands) -> None:
    """Twice as slow, with pauses, and right."""
    hands.slower = 2
    need(len(hands.stages) < 6)
    for stage in hands.stages:
        hands.wait(some(hands, 1, 10))
        hands.do(stage)


# Playing them


def held_back() -> list[Cause]:
    """Return the causes of this file."""
    return [one for one in CAUSES if one.play.__module__ == __name__]


def scenes_of(one: Cause) -> int:
    """Return in how many scenes of each of its tasks a cause is played."""
    return {1: 8, 2: 4}.get(len(one.tasks), 3 if len(one.tasks) == 3 else 2)


def indices_of(one: Cause) -> list[int]:
    """Return all indices of the split, in an order of the cause's own."""
    start = zlib.crc32(one.name.encode())
    return [(start + 7 * number) % EPISODES for number in range(EPISODES)]


def play(one: Cause) -> Iterator[Course]:
    """Play a cause in its scenes."""
    return play_causes([one], indices_of(one), scenes_of(one), SPLIT)
