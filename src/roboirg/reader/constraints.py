"""Constraints: turn a command into tests of goals, one for each slot that goals of a task have."""

from __future__ import annotations

import itertools
from collections.abc import Callable, Collection, Iterator, Sequence
from typing import NamedTuple

from roboirg.core.episode import Goal
from roboirg.reader.command import Command
from roboirg.reader.ordinals import read_position
from roboirg.reader.quantities import read_times
from roboirg.reader.reference_resolution import Amounts, ReferenceResolver, common_options
from roboirg.reader.several_amounts import read_several_amounts
from roboirg.reader.temporal_relations import TemporalRelation, read_temporal_relation

GoalTest = Callable[[Goal], bool]


class Constraint(NamedTuple):
    """A test of goals, and the complaint for the case that no goal of the task passes it."""

    fits: GoalTest
    complaint: str


def goal_constraints(
    candidates: Sequence[Goal], command: Command, resolver: ReferenceResolver
) -> list[Constraint]:
    """Return what a goal must pass to fit the command."""
    slots = candidates[0].as_mapping() if candidates else ()
    constraints: list[Constraint] = []
    if "counts" in slots:
        constraints.append(Constraint(_amounts(command, resolver), _no_goal("amounts")))
    elif "colors" in slots:
        constraints.append(Constraint(_things_in_order(command, resolver), _no_goal("things")))
    if "color" in slots:
        things = command.boxes if resolver.chooses_box else command.things
        constraints.append(_text("color", common_options(map(resolver.colors_of, things))))
    constraints += _numbers(slots, candidates, command, resolver)
    if "relation" in slots:
        when = _moment(command.text)
        moments = resolver.moments_at(read_position(command.text)) if when is None else None
        moments = moments or resolver.moments(when)
        constraints.append(_text("relation", moments))
    return constraints


def _moment(text: str) -> TemporalRelation | None:
    """Return the description of a moment; *there* points at the place of an introduced one."""
    pointed = TemporalRelation("introduced") if "there" in text.split() else None
    return read_temporal_relation(text) or pointed


def _numbers(
    slots: Collection[str],
    candidates: Sequence[Goal],
    command: Command,
    resolver: ReferenceResolver,
) -> Iterator[Constraint]:
    """Yield the constraints of the slots that hold one number."""
    if "repeats" in slots:
        yield _number("repeats", resolver.repeats(read_times(command.text)), candidates)
    for series in ("visit", "placement"):
        if series in slots:
            options = resolver.positions(read_position(command.text))
            yield _number(series, options, candidates)


def _number(slot: str, options: Collection[int] | None, candidates: Sequence[Goal]) -> Constraint:
    possible = sorted({goal.number(slot) for goal in candidates})
    return Constraint(
        lambda goal: options is None or goal.number(slot) in options,
        f"the number is out of range: {slot} can be {possible[0]} to {possible[-1]}",
    )


def _text(slot: str, options: Collection[str] | None) -> Constraint:
    return Constraint(lambda goal: options is None or goal.text(slot) in options, _no_goal(slot))


def _no_goal(part: str) -> str:
    return f"no goal of the task has the {part} that the command names"


def _things_in_order(command: Command, resolver: ReferenceResolver) -> GoalTest:
    """Return a test for as many colors as things, each among those that its words allow."""
    wanted = [resolver.colors_of(thing) for thing in command.things_in_order]

    def fits(goal: Goal) -> bool:
        colors = goal.texts("colors")
        if wanted and len(wanted) != len(colors):
            return False
        pairs = zip(colors, wanted, strict=False)
        return all(options is None or color in options for color, options in pairs)

    return fits


def _amounts(command: Command, resolver: ReferenceResolver) -> GoalTest:
    """Return a test for colors with numbers that match the items one to one, in any order."""
    several = read_several_amounts(command.text)
    if several is None:
        items = [resolver.amounts(item) for item in command.items]
    else:
        items = resolver.several_amounts(several)

    def fits(goal: Goal) -> bool:
        amounts = goal.amounts
        if not items:
            return several is None or several.leaves_open([number for _, number in amounts])
        return len(items) == len(amounts) and any(
            _match(amounts, order) for order in itertools.permutations(items)
        )

    return fits


def _match(amounts: Sequence[tuple[str, int]], items: Sequence[Amounts]) -> bool:
    for (color, number), options in zip(amounts, items, strict=True):
        if color not in options:
            return False
        numbers = options[color]
        if numbers is not None and number not in numbers:
            return False
    return True
