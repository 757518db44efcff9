"""Constraints: which goals of a scene the acts of a command leave."""

from __future__ import annotations

import itertools
from collections import Counter
from collections.abc import Iterable, Iterator, Mapping, Sequence
from typing import NamedTuple

from roboirg.core.episode import Goal, Scene, SlotValue
from roboirg.reader.command import Act
from roboirg.reader.referents import Referents
from roboirg.reader.series import Target, TargetWay, Visit
from roboirg.reader.things import ALL_OF_THEM, Description

Values = set[str] | set[int] | None
"""The values that a slot can have; None for any."""

_REPEATABLE_VERBS = ("take", "uncover", "move", "put", "repeat", "")
"""Verbs of acts that can be repeated; empty where none is said."""
_SWING_SIDES = ["right", "left"]
"""The sides in the order in which a cube swings over them."""
_NUMBER_PARTS = ("times", "more", "extra", "again")
"""Parts of an act that say how often."""
_DESTINATION_PARTS = ("goal", "down", "way", "target")
"""Parts of an act that say where something goes."""


class UnfitWordsError(Exception):
    """A command contradicts itself, or says what no slot of the goal takes."""


def fitting_goals(
    acts: Sequence[Act], goals: Sequence[Goal], scene: Scene, *, is_alone: bool
) -> tuple[Goal, ...]:
    """Return the goals of a scene that fit a command.

    Every slot of a goal (``color``, ``repeats``, ...) must have a value that the acts of the
    command allow. What the command leaves open, any goal fits.

    Args:
        acts: of the command.
        goals: of the scene.
        scene: what it is about.
        is_alone: whether nothing else is said about numbers, so that none means once.

    Raises:
        UnfitWordsError: it contradicts itself, or says what no slot takes.
    """
    command = _Command(acts, scene)
    slots = dict(goals[0].slots) if goals else {}
    command.check(slots)
    allowed_by_slot = _allowed_values(command, goals, is_alone=is_alone)
    fitting = [goal for goal in goals if _fits(goal, allowed_by_slot)]
    if "counts" in slots:
        amounts = command.amounts()
        if amounts:
            fitting = [goal for goal in fitting if dict(goal.amounts) in amounts]
    elif "colors" in slots:
        colors_in_order = command.sequence()
        fitting = [goal for goal in fitting if _fits_in_order(goal, colors_in_order)]
    return tuple(fitting)


def _allowed_values(
    command: _Command, goals: Sequence[Goal], *, is_alone: bool
) -> dict[str, Values]:
    """Return what a command allows each slot that holds a single value: ``{"color": {"red"}}``.

    None instead of a set allows any value. Slots that the goals of the scene do not have are left
    out.
    """
    slots = dict(goals[0].slots) if goals else {}
    allowed: dict[str, Values] = {}
    if "visit" in slots:
        allowed["visit"] = command.visits(max(goal.number("visit") for goal in goals))
    if "repeats" in slots:
        allowed["repeats"] = command.repeats(is_alone=is_alone)
        _check_range(allowed["repeats"], goals)
    if "relation" in slots:
        allowed["relation"] = command.relations()
    if "placement" in slots:
        allowed["placement"] = command.placements(max(goal.number("placement") for goal in goals))
    if "color" in slots:
        allowed["color"] = command.colors()
    return allowed


def _fits(goal: Goal, allowed: Mapping[str, Values]) -> bool:
    """Return whether a goal has an allowed value in each slot."""
    return all(values is None or goal[slot] in values for slot, values in allowed.items())


def _fits_in_order(goal: Goal, allowed_in_order: Sequence[Values]) -> bool:
    """Return whether a goal's colors are those that a command allows, one by one.

    Of ``[{"red"}, None]``, the first color must be red and the second can be any. Any goal fits an
    empty sequence.
    """
    if not allowed_in_order:
        return True
    colors = goal.texts("colors")
    if len(colors) != len(allowed_in_order):
        return False
    for color, possible in zip(colors, allowed_in_order, strict=True):
        if possible is not None and color not in possible:
            return False
    return True


def _kind_of(goal: object) -> str:
    """Return the kind of an object to which something goes."""
    if isinstance(goal, str):
        return goal.removesuffix("s")
    if isinstance(goal, Description):
        return "box"
    return "target"


def _check_range(values: Values, goals: Sequence[Goal]) -> None:
    """Refuse numbers of times if no goal of the scene has any of them; None is any number."""
    numbers = {goal.number("repeats") for goal in goals}
    if values is not None and not values & numbers:
        raise UnfitWordsError(
            f"the number is out of range: repeats can be {min(numbers)} to {max(numbers)}"
        )


def _from_start(rank: int, last: int) -> int:
    """Return a rank counted from the start: of ``-1`` the last one."""
    if rank > 0:
        return rank
    return last + 1 + rank


class _NamedThing(NamedTuple):
    """A thing that a command names, and what is to be done with it."""

    act: Act
    thing: Description


class _Amount(NamedTuple):
    """A number of cubes of a color."""

    color: str
    number: int


class _Command:
    """The acts of a command, in a scene."""

    def __init__(self, acts: Sequence[Act], scene: Scene) -> None:
        self._acts = acts
        self._scene = scene
        self._referents = Referents(scene)
        self._named = tuple(self._named_things())

    def check(self, slots: Mapping[str, SlotValue]) -> None:
        """Refuse a command that says what no slot of the task's goals takes, such as a placement.

        Raises `UnfitWordsError`. `slots` are those of any goal of the scene, with its values: only
        the names count.
        """
        for act in self._acts:
            self._check_act(act, slots)
        for target in self._targets():
            if target.rank is not None and "placement" not in slots:
                raise UnfitWordsError("does not understand which target is meant")
            if target.relation is not None and "relation" not in slots:
                raise UnfitWordsError("does not understand which target is meant")
        if "color" not in slots and "colors" not in slots:
            self._check_uncolored("repeats" in slots)
        sides_in_order = self._sides()
        targets = self._scene.of_kind("target")
        # A cube swings over two targets, always over the right one first.
        if sides_in_order and (len(targets) != len(_SWING_SIDES) or sides_in_order != _SWING_SIDES):
            raise UnfitWordsError("does not understand the way between the targets")

    def _check_act(self, act: Act, slots: Mapping[str, SlotValue]) -> None:
        """Refuse an act that cannot be done, or has a number of times that no goal takes."""
        self._check_goals(act)
        if act.verb in ("press", "stop"):
            is_once = all(number == 1 for number in act.values("times"))
            if not is_once or act.has("more", "extra"):
                raise UnfitWordsError("does not understand how often to press")
        if act.has("visit", "passed") and "visit" not in slots:
            raise UnfitWordsError("does not understand when to act")
        if act.verb in _REPEATABLE_VERBS and act.has(*_NUMBER_PARTS) and "repeats" not in slots:
            raise UnfitWordsError("does not understand how often to act")

    def _check_goals(self, act: Act) -> None:
        """Refuse an act that puts something nowhere, or in what the scene does not have."""
        if act.verb == "put" and not act.has(*_DESTINATION_PARTS):
            raise UnfitWordsError("does not understand where to put it")
        kinds_there = {item.kind for item in self._scene.objects} | {"table"}
        for goal in act.values("goal"):
            kind = _kind_of(goal)
            if kind not in kinds_there:
                raise UnfitWordsError(f"there is no {kind} in the scene")

    def _check_uncolored(self, is_shown: bool) -> None:
        """Refuse words that choose among things where the goal says nothing about which thing.

        Only *cube* or *one* without color or place will do. With `is_shown`, several cubes are
        there and the video shows which one is meant, so that it must be *the cube* or the one in
        the video.
        """
        for named in self._named:
            thing = named.thing
            is_unlike_shown = is_shown and not (thing.is_definite or thing.is_shown)
            if thing.noun not in ("cube", "one") or not thing.is_open or is_unlike_shown:
                raise UnfitWordsError(f'does not understand which "{thing.noun}" is meant')

    def visits(self, last: int) -> Values:
        """Return at which visits of a moving cube to a target to act, from 1; None for any.

        *Stop it at the second visit* gives ``{2}``; *let it pass twice, and stop it the next time*,
        ``{3}``. `last` is the number of the last visit.
        """
        passed: list[int] = []
        for act in self._acts:
            passed += act.values("passed")
        numbers: set[int] = set()
        for act in self._acts:
            for visit in act.values("visit"):
                numbers.add(self._visit(visit, passed, last))
        if passed and not numbers:  # "let it pass twice" does not say at which visit to act
            raise UnfitWordsError("does not understand when to act")
        return self._only_value(numbers, "visit")

    def _visit(self, visit: Visit, passed: Sequence[int], last: int) -> int:
        """Return the number of the visit that words name, from 1.

        `passed` has how many visits pass before, if that is said: *let it pass twice, and stop it
        at the next visit* means the third. `last` is the number of the last visit, for *the last
        one*.
        """
        if not passed:
            if visit.rank is None:
                raise UnfitWordsError("does not understand which visit is the next one")
            return _from_start(visit.rank, last)
        following = passed[0] + 1
        if visit.rank not in (None, following):
            raise UnfitWordsError("does not understand which visit is meant")
        return _from_start(following, last)

    def repeats(self, *, is_alone: bool) -> Values:
        """Return the numbers of times that a command can mean; None for any.

        *Lift the cube twice* gives ``{2}``, *lift the cube twice, then once more* ``{3}`` and *lift
        the cube again and again* ``{3}``. Without a number it means once, ``{1}``, if `is_alone`:
        nothing before the command speaks of numbers.
        """
        totals: set[int] = set()  # numbers that are said, "twice"; they must agree
        more = 0  # what is added to them, "once more"
        is_first = True
        has_pressed = False
        for act in self._acts:
            if act.verb in ("press", "stop"):
                has_pressed = True
                continue  # the button is pressed once, whatever is repeated
            if act.verb == "repeat" and has_pressed and act.has(*_NUMBER_PARTS):
                raise UnfitWordsError("does not understand what to repeat")
            if act.verb == "repeat" and act.values("times") == [1] and not is_first:
                more += 1  # "Repeat once"
                continue

            totals.update(act.values("times"))
            if is_first and act.verb == "take" and self._scene.past:
                totals.update(act.values("extra"))  # the video shows the first time
            elif act.has("extra"):
                raise UnfitWordsError("does not understand how often to act in all")
            else:
                more += len(act.values("again"))
            more += sum(act.values("more"))
            if act.verb in _REPEATABLE_VERBS:
                is_first = False

        self._only_value(totals, "number of times")  # refuses two that differ
        if totals:
            return {sum(totals) + more}
        if not more and not is_alone:
            return None
        return {1 + more}

    def relations(self) -> Values:
        """Return the possible relations to the press of the button."""
        relations = [target.relation for target in self._targets() if target.relation is not None]
        return self._only_value(relations, "target")

    def placements(self, last: int) -> Values:
        """Return the possible placements; `last` is the last one."""
        ranks = [target.rank for target in self._targets() if target.rank is not None]
        return self._only_value([_from_start(rank, last) for rank in ranks], "target")

    def colors(self) -> Values:
        """Return the colors of the thing that a command means, by all words about it; None for any.

        *The red cube* gives ``{"red"}``; *the cube on the left*, the colors of what may be meant
        there.
        """
        kind = self._referents.chosen  # among things of this kind the goals choose
        possible_colors: set[str] | None = None
        for thing in self._things_to_choose(kind):
            if thing.noun not in (kind, "one") or thing.number not in (None, 1):
                raise UnfitWordsError(f'does not understand "{thing.noun}" and its number')
            colors = self._colors_in_scene(thing)
            if possible_colors is not None:
                colors = colors & possible_colors
            possible_colors = colors
        if possible_colors is not None and not possible_colors:
            raise UnfitWordsError("does not understand which color is meant")
        return possible_colors

    def _things_to_choose(self, kind: str) -> list[Description]:
        """Return the descriptions of the thing that the goal chooses by its color.

        That is the thing to handle, or the box into which it goes where goals choose a box.
        """
        if kind != "box":
            return [named.thing for named in self._named if not named.thing.is_open]
        boxes: list[Description] = []
        for act in self._acts:
            boxes += [goal for goal in act.values("goal") if isinstance(goal, Description)]
        return boxes

    def sequence(self) -> list[Values]:
        """Return the colors that each thing to lift can have, in the order of lifting.

        *Lift the red one, then the one on the left* gives ``[{"red"}, {"blue"}]`` if blue is on the
        left.
        """
        colors_in_order: list[Values] = []
        for act, thing in self._named:
            if thing.is_open:
                continue
            if thing.noun not in ("container", "cube", "one") or thing.number not in (None, 1):
                raise UnfitWordsError(f'does not understand "{thing.noun}" and its number')
            colors = self._colors_in_scene(thing)
            # "Lift the red cube, then put the red cube down" is about one thing.
            is_again = thing.is_definite and bool(colors_in_order) and colors_in_order[-1] == colors
            if act.verb == "put" and not is_again:
                raise UnfitWordsError("does not understand what to put down")
            if not is_again:
                colors_in_order.append(colors)
        if len(colors_in_order) > 1:
            self._check_first()
        return colors_in_order

    def _check_first(self) -> None:
        """Refuse *first* after a later thing, which leaves the order unclear.

        *Lift the red one, the blue one first* is refused.
        """
        things = 0
        for act in self._acts:
            for part in act.parts:
                if part.kind == "thing":
                    things += 1
                if part.kind == "first" and things > 1:
                    raise UnfitWordsError("does not understand what comes first")

    def amounts(self) -> list[dict[str, int]]:
        """Return all amounts of cubes by color that a command can mean; empty if it names none.

        *A red cube and the one on the left* gives ``[{"red": 2}, {"red": 1, "blue": 1}]`` if a red
        or a blue one may be meant on the left.
        """
        mentions = self._amount_mentions()
        if not mentions:
            return []
        possible_totals: list[dict[str, int]] = []
        for meant_amounts in itertools.product(*mentions):  # one for each mention
            total: Counter[str] = Counter()
            for amount in meant_amounts:
                total[amount.color] += amount.number
            possible_totals.append(dict(total))
        return possible_totals

    def _amount_mentions(self) -> list[list[_Amount]]:
        """Return, for each time that the command names cubes, the amounts that it can mean there.

        *two red cubes* gives ``[(red, 2)]``, and *two cubes* one entry for each color; *two of each
        color* counts as one mention for each color.
        """
        mentions: list[list[_Amount]] = []
        for named in self._named:
            possible = self._possible_amounts(named.thing)
            # "Take a red cube, then put the red cube into the bin" is about one cube.
            is_again = named.thing.is_definite and possible in mentions
            if not is_again:
                mentions.append(possible)
        for act in self._acts:
            for number in act.values("each"):
                for color in sorted(self._referents.colors):
                    mentions.append([_Amount(color, number)])
        return mentions

    def _possible_amounts(self, thing: Description) -> list[_Amount]:
        """Return the amounts that a description can mean, one for each color that it may have.

        *two red cubes* gives ``[(red, 2)]``, *two cubes* ``[(blue, 2), (red, 2)]``.
        """
        if thing.noun not in ("cube", "one"):
            raise UnfitWordsError(f'there is no "{thing.noun}" to put into the bin')
        if thing.is_open:
            if thing.number in (None, ALL_OF_THEM):
                raise UnfitWordsError("does not understand how many cubes are meant")
            colors = self._referents.colors
        else:
            colors = self._colors_in_scene(thing)
        return [_Amount(color, self._count(thing, color)) for color in sorted(colors)]

    def _count(self, thing: Description, color: str) -> int:
        """Return how many cubes of a color a description means."""
        if thing.number is None:
            raise UnfitWordsError("does not understand how many cubes are meant")
        if thing.number == ALL_OF_THEM:
            return self._referents.count_of(color)
        return thing.number

    def _named_things(self) -> Iterator[_NamedThing]:
        """Yield each thing that the command names, with the act that handles it.

        Words that only point back at a named thing are left out. *It* before any thing is refused:
        what comes before the command is not read.
        """
        has_named = False
        for act in self._acts:
            for kind, value in act.parts:
                if kind == "it" and act.verb not in ("repeat", "stop", "press") and not has_named:
                    raise UnfitWordsError(f'does not read what "{value}" points back at')
                if kind != "thing" or act.verb == "press":
                    continue
                can_point_back = value.is_open and value.is_definite and value.number in (None, 1)
                if not can_point_back or not has_named:
                    yield _NamedThing(act, value)
                has_named = True

    def _targets(self) -> Iterator[Target]:
        """Yield the targets that are named."""
        for act in self._acts:
            for value in (*act.values("goal"), *act.values("target")):
                if isinstance(value, Target):
                    yield value

    def _sides(self) -> list[str]:
        """Return on which sides the targets are over which the command swings a cube, in its order.

        Both for the robot: ``["right", "left"]``.
        """
        found: list[str] = []
        for act in self._acts:
            for part in act.parts:
                if isinstance(part.value, TargetWay):
                    found += part.value.sides
                elif isinstance(part.value, Target) and part.value.side:
                    found.append(part.value.side)
        return found

    def _colors_in_scene(self, thing: Description) -> set[str]:
        """Return the colors that a description can mean, of things that the scene has.

        Raises `UnfitWordsError` if it fits none.
        """
        found = self._referents.colors_of(thing)
        if found:
            return found
        described = thing.under or thing
        if described.color and described.place is None:
            raise UnfitWordsError(f"there is nothing {described.color} in the scene")
        raise UnfitWordsError("there is nothing to handle at the place that the text names")

    def _only_value(self, values: Iterable[str | int], name: str) -> Values:
        """Return the only value that is named, as a set; None if there is none.

        Two values that differ are refused. `name` is what the values are of, for the complaint.
        """
        found = set(values)
        if len(found) > 1:
            named = " and ".join(sorted(map(str, found)))
            raise UnfitWordsError(f'does not know which {name} is meant, "{named}"')
        return found or None  # type: ignore[return-value]
