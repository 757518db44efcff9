"""From what was understood to tests of goals, one for each slot that a task's goals have."""

from __future__ import annotations

import itertools
from collections.abc import Callable, Collection, Sequence

from roboirg.core.episode import Goal
from roboirg.language.interpreter.command import Command
from roboirg.language.interpreter.ordinals import read_position
from roboirg.language.interpreter.quantities import read_times
from roboirg.language.interpreter.reference_resolution import Amounts, ReferenceResolver, common
from roboirg.language.interpreter.temporal_relations import read_temporal_relation

Test = Callable[[Goal], bool]


def tests_for(slots: Collection[str], command: Command, listener: ReferenceResolver) -> list[Test]:
    """What a goal must pass to fit the command.

    Args:
        slots: names of the slots that the goals have.
        command: what was said last.
        listener: who knows what was said before.
    """
    tests: list[Test] = []
    if "counts" in slots:
        tests.append(_amounts(command, listener))
    elif "colors" in slots:
        tests.append(_things_in_order(command, listener))
    if "color" in slots:
        things = command.boxes if listener.chooses_box else command.things
        colors = common(listener.objects(thing) for thing in things)
        tests.append(lambda goal: colors is None or goal.text("color") in colors)
    if "repeats" in slots:
        tests.append(_number("repeats", listener.times(read_times(command.text))))
    tests += [
        _number(series, listener.positions(read_position(command.text)))
        for series in ("visit", "placement")
        if series in slots
    ]
    if "relation" in slots:
        moments = listener.moments(read_temporal_relation(command.text))
        tests.append(lambda goal: moments is None or goal.text("relation") in moments)
    return tests


def _number(slot: str, options: Collection[int] | None) -> Test:
    return lambda goal: options is None or goal.number(slot) in options


def _things_in_order(command: Command, listener: ReferenceResolver) -> Test:
    """As many colors as things, each among those that its words leave open."""
    wanted = [listener.objects(thing) for thing in command.things]

    def fits(goal: Goal) -> bool:
        colors = goal.texts("colors")
        if wanted and len(wanted) != len(colors):
            return False
        pairs = zip(colors, wanted, strict=False)
        return all(options is None or color in options for color, options in pairs)

    return fits


def _amounts(command: Command, listener: ReferenceResolver) -> Test:
    """Each color with its number is one of the items, in any order, and each item is one."""
    items = [listener.amounts(item) for item in command.items]

    def fits(goal: Goal) -> bool:
        told = list(zip(goal.texts("colors"), goal.numbers("counts"), strict=True))
        if not items:
            return True
        return len(items) == len(told) and any(
            _agree(told, order) for order in itertools.permutations(items)
        )

    return fits


def _agree(told: Sequence[tuple[str, int]], items: Sequence[Amounts]) -> bool:
    for (color, number), options in zip(told, items, strict=True):
        if color not in options:
            return False
        numbers = options[color]
        if numbers is not None and number not in numbers:
            return False
    return True
