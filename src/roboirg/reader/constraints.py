"""Find the goals of a scene that satisfy the clauses of a command.

Each clause constrains slots of the goal: *the red cube* allows the value ``red`` for the slot
``color``. A slot that no clause constrains may have any value.
"""

from __future__ import annotations

import itertools
from collections import Counter
from collections.abc import Iterable, Iterator, Mapping, Sequence
from typing import Final, NamedTuple

from roboirg.core.episode import Goal, Scene, SlotValue
from roboirg.reader.command import Clause
from roboirg.reader.referents import Referents
from roboirg.reader.series import SwingPath, Target, Visit
from roboirg.reader.things import ALL_OF_THEM, Description

AllowedValues = set[str] | set[int] | None
"""The values that a slot may have; None allows any."""

_REPEATABLE_VERBS = ("take", "uncover", "move", "put", "repeat", "")
"""Verbs of clauses that can be repeated; empty where none is said."""
_SWING_SIDES = ["right", "left"]
"""The sides in the order in which a cube swings over them."""
_NUMBER_ARGUMENTS: Final = ("times", "more", "extra", "again")
"""Kinds of arguments that say how often."""
_DESTINATION_ARGUMENTS: Final = ("goal", "down", "way", "target")
"""Kinds of arguments that say where something goes."""


class UnfitWordsError(Exception):
    """A command contradicts itself, or asks for something that no goal of the task can express.

    Its text is the complaint in plain words, such as *does not understand where to put it*.
    """


def fitting_goals(
    clauses: Sequence[Clause], goals: Sequence[Goal], scene: Scene, *, once_by_default: bool
) -> tuple[Goal, ...]:
    """Return the goals that a command can mean: those that satisfy all of its clauses.

    *Take the red cube and put it on the target twice* leaves the goal with ``color`` red and
    ``repeats`` 2. What the command does not say, any goal satisfies.

    Args:
        clauses: of the command.
        goals: all goals of the scene, which have the same slots.
        scene: what the command is about.
        once_by_default: whether a command without a number means once, not any number.

    Raises:
        UnfitWordsError: the command contradicts itself, or says what no slot takes.
    """
    command = _Command(clauses, scene)
    slots = dict(goals[0].slots) if goals else {}
    command.check(slots)
    allowed = _allowed_values(command, goals, once_by_default=once_by_default)
    fitting = [goal for goal in goals if _fits(goal, allowed)]
    # Slots with several values each: BinFill counts cubes by color, others order colors.
    if "counts" in slots:
        amounts = command.amounts()
        if amounts:
            fitting = [goal for goal in fitting if dict(goal.amounts) in amounts]
    elif "colors" in slots:
        colors_in_order = command.colors_in_order()
        fitting = [goal for goal in fitting if _fits_in_order(goal, colors_in_order)]
    return tuple(fitting)


def _allowed_values(
    command: _Command, goals: Sequence[Goal], *, once_by_default: bool
) -> dict[str, AllowedValues]:
    """Return the values that a command allows for each slot with a single value.

    *Lift the red cube* gives ``{"color": {"red"}, "repeats": {1}}``; None instead of a set allows
    any value. Slots that the goals do not have are left out.
    """
    slots = dict(goals[0].slots) if goals else {}
    allowed = {}
    if "visit" in slots:
        allowed["visit"] = command.visits(max(goal.number("visit") for goal in goals))
    if "repeats" in slots:
        allowed["repeats"] = command.repeats(once_by_default=once_by_default)
        _check_range(allowed["repeats"], goals)
    if "relation" in slots:
        allowed["relation"] = command.relations()
    if "placement" in slots:
        allowed["placement"] = command.placements(max(goal.number("placement") for goal in goals))
    if "color" in slots:
        allowed["color"] = command.colors()
    return allowed


def _fits(goal: Goal, allowed: Mapping[str, AllowedValues]) -> bool:
    """Return whether a goal has an allowed value in each slot; None allows any value."""
    return all(values is None or goal[slot] in values for slot, values in allowed.items())


def _fits_in_order(goal: Goal, allowed_in_order: Sequence[AllowedValues]) -> bool:
    """Return whether a goal's colors are those that a command allows, one by one.

    With ``[{"red"}, None]``, the first color must be red and the second can be any. An empty
    sequence allows every goal, one of another length than the goal's colors none.
    """
    if not allowed_in_order:
        return True
    colors = goal.texts("colors")
    if len(colors) != len(allowed_in_order):
        return False
    for color, allowed in zip(colors, allowed_in_order, strict=True):
        if allowed is not None and color not in allowed:
            return False
    return True


def _kind_of_destination(value: object) -> str:
    """Return the kind of object to which something goes: ``bin``, ``table``, ``box``, ``target``.

    `value` is the meaning of *in the bin*, *on the table*, *into the red box* or *on the target*.
    """
    if isinstance(value, str):
        return value.removesuffix("s")
    if isinstance(value, Description):
        return "box"
    return "target"


def _check_range(repeats: AllowedValues, goals: Sequence[Goal]) -> None:
    """Raise `UnfitWordsError` if no goal has any of the allowed numbers of repetitions.

    None allows any number, so it passes.
    """
    numbers = {goal.number("repeats") for goal in goals}
    if repeats is not None and not repeats & numbers:
        raise UnfitWordsError(
            f"the number is out of range: repeats can be {min(numbers)} to {max(numbers)}"
        )


def _from_start(rank: int, last: int) -> int:
    """Return a rank counted from the start, 1 for the first: of -1, the last one, it is `last`."""
    if rank > 0:
        return rank
    return last + 1 + rank


class _NamedThing(NamedTuple):
    """A thing that a command names, and the clause that says what is to be done with it."""

    clause: Clause
    thing: Description


class _Amount(NamedTuple):
    """A number of cubes of a color: *two red cubes*."""

    color: str
    number: int


class _Command:
    """The clauses of a command about a scene, as constraints on the slots of goals."""

    def __init__(self, clauses: Sequence[Clause], scene: Scene) -> None:
        self._clauses = clauses
        self._scene = scene
        self._referents = Referents(scene)
        # Found once, as this refuses a command that points back at what comes before it.
        self._named = tuple(self._named_things())

    def check(self, slots: Mapping[str, SlotValue]) -> None:
        """Raise `UnfitWordsError` if the command says what no slot of the task's goals takes.

        *the second target used* is such a thing in a task without the slot ``placement``. `slots`
        are those of any goal of the scene: only their names count.
        """
        for clause in self._clauses:
            self._check_clause(clause, slots)
        for target in self._targets():
            if target.rank is not None and "placement" not in slots:
                raise UnfitWordsError("does not understand which target is meant")
            if target.relation is not None and "relation" not in slots:
                raise UnfitWordsError("does not understand which target is meant")
        if "color" not in slots and "colors" not in slots:
            self._check_uncolored(is_in_video="repeats" in slots)
        sides = self._target_sides()
        targets = self._scene.of_kind("target")
        # A cube swings over two targets, always over the right one first.
        if sides and (len(targets) != len(_SWING_SIDES) or sides != _SWING_SIDES):
            raise UnfitWordsError("does not understand the way between the targets")

    def _check_clause(self, clause: Clause, slots: Mapping[str, SlotValue]) -> None:
        """Raise `UnfitWordsError` for a number or moment that no slot of the goals takes.

        The button is pressed once, so *press it twice* is refused.
        """
        self._check_destination(clause)
        if clause.verb in ("press", "stop"):
            is_once = all(number == 1 for number in clause.values("times"))
            if not is_once or clause.has("more", "extra"):
                raise UnfitWordsError("does not understand how often to press")
        if clause.has("visit", "passed") and "visit" not in slots:
            raise UnfitWordsError("does not understand when to act")
        is_repeatable = clause.verb in _REPEATABLE_VERBS
        if is_repeatable and clause.has(*_NUMBER_ARGUMENTS) and "repeats" not in slots:
            raise UnfitWordsError("does not understand how often to act")

    def _check_destination(self, clause: Clause) -> None:
        """Raise `UnfitWordsError` if a thing goes nowhere, or to what the scene does not have.

        *Put the red cube*, which lacks a destination, and *put it into the bin* without a bin.
        """
        if clause.verb == "put" and not clause.has(*_DESTINATION_ARGUMENTS):
            raise UnfitWordsError("does not understand where to put it")
        kinds_there = {item.kind for item in self._scene.objects} | {"table"}
        for destination in clause.values("goal"):
            kind = _kind_of_destination(destination)
            if kind not in kinds_there:
                raise UnfitWordsError(f"there is no {kind} in the scene")

    def _check_uncolored(self, *, is_in_video: bool) -> None:
        """Raise `UnfitWordsError` for words that choose a thing where the goal has no color.

        Only *cube* or *one* without a color or place will do. If several cubes are there and the
        video shows which one is meant (`is_in_video`), *a cube* will not: it must be *the cube*, or
        the one in the video.
        """
        for named in self._named:
            thing = named.thing
            is_vague = is_in_video and not (thing.is_definite or thing.is_shown)
            if thing.noun not in ("cube", "one") or not thing.leaves_color_open or is_vague:
                raise UnfitWordsError(f'does not understand which "{thing.noun}" is meant')

    def visits(self, last: int) -> AllowedValues:
        """Return at which visits of a moving cube to a target to act, from 1; None for any.

        *Stop it at the second visit* gives ``{2}``; *let it pass twice, and stop it the next time*,
        ``{3}``. `last` is the number of the last visit.
        """
        passed: list[int] = []
        for clause in self._clauses:
            passed += clause.values("passed")
        numbers = set()
        for clause in self._clauses:
            for visit in clause.values("visit"):
                numbers.add(self._number_of_visit(visit, passed, last))
        if passed and not numbers:  # "let it pass twice" does not say at which visit to act
            raise UnfitWordsError("does not understand when to act")
        return self._only_value(numbers, "visit")

    def _number_of_visit(self, visit: Visit, passed: Sequence[int], last: int) -> int:
        """Return the number of a visit, from 1.

        Args:
            visit: as words name it, *the next visit*.
            passed: how many visits pass before, if that is said: after *let it pass twice*, the
                next visit is the third.
            last: number of the last visit, for *the last one*.
        """
        if not passed:
            if visit.rank is None:
                raise UnfitWordsError("does not understand which visit is the next one")
            return _from_start(visit.rank, last)
        following = passed[0] + 1
        if visit.rank not in (None, following):
            raise UnfitWordsError("does not understand which visit is meant")
        return following

    def repeats(self, *, once_by_default: bool) -> AllowedValues:
        """Return the numbers of repetitions that the command can mean; None for any.

        *Lift the cube twice* gives ``{2}``, *lift the cube twice, then once more* ``{3}`` and *lift
        the cube again and again* ``{3}``. Without a number it is ``{1}`` if `once_by_default`.
        """
        totals: set[int] = set()  # numbers that are said, "twice"; they must agree
        more = 0  # what is added to them, "once more"
        is_first = True
        has_pressed = False
        for clause in self._clauses:
            if clause.verb in ("press", "stop"):
                has_pressed = True
                continue  # the button is pressed once, whatever is repeated
            if clause.verb == "repeat" and has_pressed and clause.has(*_NUMBER_ARGUMENTS):
                raise UnfitWordsError("does not understand what to repeat")
            if clause.verb == "repeat" and clause.values("times") == [1] and not is_first:
                more += 1  # "Repeat once"
                continue

            totals.update(clause.values("times"))
            if is_first and clause.verb == "take" and self._scene.past:
                totals.update(clause.values("extra"))  # the video shows the first time
            elif clause.has("extra"):
                raise UnfitWordsError("does not understand how often to act in all")
            else:
                more += len(clause.values("again"))
            more += sum(clause.values("more"))
            if clause.verb in _REPEATABLE_VERBS:
                is_first = False

        self._only_value(totals, "number of times")  # refuses two that differ
        if totals:
            return {sum(totals) + more}
        if not more and not once_by_default:
            return None
        return {1 + more}

    def relations(self) -> AllowedValues:
        """Return the relations to the press of the button, ``{"before"}``; None for any."""
        relations = [target.relation for target in self._targets() if target.relation is not None]
        return self._only_value(relations, "target")

    def placements(self, last: int) -> AllowedValues:
        """Return the numbers of the placement that is meant, from 1; None for any.

        *The last target used* gives ``{4}`` if `last`, the number of the last placement, is 4.
        """
        ranks = [target.rank for target in self._targets() if target.rank is not None]
        return self._only_value([_from_start(rank, last) for rank in ranks], "target")

    def colors(self) -> AllowedValues:
        """Return the colors of the thing that the command means; None for any.

        *The red cube* gives ``{"red"}``; *the cube on the left*, the colors of what may be meant
        there. If the thing is named several times, all of its descriptions have to fit.
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

        That is the thing to handle; where `kind` is ``box``, it is the box into which it goes.
        """
        if kind != "box":
            return [named.thing for named in self._named if not named.thing.leaves_color_open]
        boxes: list[Description] = []
        for clause in self._clauses:
            boxes += [value for value in clause.values("goal") if isinstance(value, Description)]
        return boxes

    def colors_in_order(self) -> list[AllowedValues]:
        """Return the colors that each thing to lift can have, in the order of lifting.

        *Lift the red one, then the one on the left* gives ``[{"red"}, {"blue"}]`` if blue is on the
        left.
        """
        colors_in_order: list[AllowedValues] = []
        for clause, thing in self._named:
            if thing.leaves_color_open:
                continue
            if thing.noun not in ("container", "cube", "one") or thing.number not in (None, 1):
                raise UnfitWordsError(f'does not understand "{thing.noun}" and its number')
            colors = self._colors_in_scene(thing)
            # "Lift the red cube, then put the red cube down" is about one thing.
            is_again = thing.is_definite and bool(colors_in_order) and colors_in_order[-1] == colors
            if clause.verb == "put" and not is_again:
                raise UnfitWordsError("does not understand what to put down")
            if not is_again:
                colors_in_order.append(colors)
        if len(colors_in_order) > 1:
            self._check_first()
        return colors_in_order

    def _check_first(self) -> None:
        """Raise `UnfitWordsError` for *first* after a later thing, which leaves the order unclear.

        *Lift the red one, the blue one first* is refused.
        """
        things = 0
        for clause in self._clauses:
            for argument in clause.arguments:
                if argument.kind == "thing":
                    things += 1
                if argument.kind == "first" and things > 1:
                    raise UnfitWordsError("does not understand what comes first")

    def amounts(self) -> list[dict[str, int]]:
        """Return all numbers of cubes by color that the command can mean; empty if it names none.

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
        for clause in self._clauses:
            for number in clause.values("each"):
                for color in sorted(self._referents.colors):
                    mentions.append([_Amount(color, number)])
        return mentions

    def _possible_amounts(self, thing: Description) -> list[_Amount]:
        """Return the amounts that a description can mean, one for each color that it may have.

        *two red cubes* gives ``[(red, 2)]``, *two cubes* ``[(blue, 2), (red, 2)]``.
        """
        if thing.noun not in ("cube", "one"):
            raise UnfitWordsError(f'there is no "{thing.noun}" to put into the bin')
        if thing.leaves_color_open:
            if thing.number in (None, ALL_OF_THEM):
                raise UnfitWordsError("does not understand how many cubes are meant")
            colors = self._referents.colors
        else:
            colors = self._colors_in_scene(thing)
        return [_Amount(color, self._count(thing, color)) for color in sorted(colors)]

    def _count(self, thing: Description, color: str) -> int:
        """Return how many cubes of a color a description means.

        *two red cubes* means 2, and *all red cubes* as many as the scene has. Raises
        `UnfitWordsError` for *the red cubes*, which does not say how many.
        """
        if thing.number is None:
            raise UnfitWordsError("does not understand how many cubes are meant")
        if thing.number == ALL_OF_THEM:
            return self._referents.count_of(color)
        return thing.number

    def _named_things(self) -> Iterator[_NamedThing]:
        """Yield each thing that the command names, with the clause that handles it.

        In *lift the red cube and put the cube down*, *the cube* points back at the red one and is
        left out. *It* before any thing raises `UnfitWordsError`: it points back at what comes
        before the command, which is not read.
        """
        has_named = False
        for clause in self._clauses:
            handles_things = clause.verb not in ("repeat", "stop", "press")
            for kind, value in clause.arguments:
                if kind == "it" and handles_things and not has_named:
                    raise UnfitWordsError(f'does not read what "{value}" points back at')
                if kind != "thing" or clause.verb == "press":
                    continue
                is_definite = value.is_definite and value.number in (None, 1)
                if not (has_named and is_definite and value.leaves_color_open):
                    yield _NamedThing(clause, value)
                has_named = True

    def _targets(self) -> Iterator[Target]:
        """Yield the targets that the command names, as destinations or otherwise, in its order."""
        for clause in self._clauses:
            for value in (*clause.values("goal"), *clause.values("target")):
                if isinstance(value, Target):
                    yield value

    def _target_sides(self) -> list[str]:
        """Return the sides of the targets that the command names by their side, in its order.

        *Swing it from the right to the left target* gives ``["right", "left"]``, as the robot sees
        them.
        """
        sides: list[str] = []
        for clause in self._clauses:
            for argument in clause.arguments:
                if isinstance(argument.value, SwingPath):
                    sides += argument.value.sides
                elif isinstance(argument.value, Target) and argument.value.side:
                    sides.append(argument.value.side)
        return sides

    def _colors_in_scene(self, thing: Description) -> set[str]:
        """Return the colors that a description can mean, of things that the scene has.

        The description says something about the color. Raises `UnfitWordsError` if it fits nothing.
        """
        found = self._referents.colors_of(thing)
        if found:
            return found
        described = thing.covers or thing
        if described.color and described.place is None:
            raise UnfitWordsError(f"there is nothing {described.color} in the scene")
        raise UnfitWordsError("there is nothing to handle at the place that the text names")

    def _only_value(self, values: Iterable[str | int], name: str) -> AllowedValues:
        """Return the value that all of some values are, as a set: ``{2}`` for 2 and 2.

        None, which allows any value, if there are none. Raises `UnfitWordsError` if two differ;
        `name` says what they are in its complaint.
        """
        found = set(values)
        if len(found) > 1:
            named = " and ".join(sorted(map(str, found)))
            raise UnfitWordsError(f'does not know which {name} is meant, "{named}"')
        return found or None  # type: ignore[return-value]
