"""The values of a goal, each under the name of its field, and the goal's name in records."""

from __future__ import annotations

import itertools
from collections.abc import Iterator

from roboirg.core.episode import Goal, values_in


def goal_fields(goal: Goal) -> dict[str, str]:
    """Return the value of each field that states a goal: ``{"color": "red", "repeats": "3"}``.

    A color with a count is one field, ``cubes.0``, with a value such as ``"2 red"``.
    """
    slots = goal.as_mapping()
    found = {}
    if "counts" in slots:
        for position, (color, count) in enumerate(goal.amounts):
            found[f"cubes.{position}"] = f"{count} {color}"
        return found
    for slot in slots:
        for field, value in fields_of(goal, slot):
            found[field] = str(value)
    return found


def fields_of(goal: Goal, slot: str) -> Iterator[tuple[str, str | int]]:
    """Yield the fields of a slot, each with its value.

    A slot with a single value is its own field: ``color`` gives ``("color", "red")``. A slot with
    several has a field for each: ``colors`` gives ``("colors.0", "red")`` and ``("colors.1",
    "blue")``.
    """
    content = goal[slot]
    if not isinstance(content, tuple):
        yield slot, content
        return
    for position, value in enumerate(values_in(content)):
        yield f"{slot}.{position}", value


def in_every_order(goal: Goal) -> Iterator[Goal]:
    """Yield a goal once for each order of its colors with their counts, which means nothing.

    *2 red and 1 blue* is also yielded as *1 blue and 2 red*. A goal without counts has one order.
    """
    if "counts" not in goal.as_mapping():
        yield goal
        return
    for amounts in itertools.permutations(goal.amounts):
        colors, counts = zip(*amounts, strict=True)  # of pairs such as ("red", 2)
        yield Goal.of(colors=colors, counts=counts)


def unordered(goal: Goal) -> Goal:
    """Return a goal with its colors, and their counts, in alphabetical order.

    *2 red and 1 blue* and *1 blue and 2 red* are the same goal. Goals without counts are returned
    as they are: there the order of the colors has a meaning.
    """
    if "counts" not in goal.as_mapping():
        return goal
    # Pairs such as ("red", 2) are sorted, then taken apart again.
    colors, counts = zip(*sorted(goal.amounts), strict=True)
    return Goal.of(colors=colors, counts=counts)


def goal_name(goal: Goal) -> str:
    """Return the name that records have for a goal: ``color red, repeats 3``.

    Published records are compared with it, so its form must not change.
    """
    return ", ".join(f"{name} {value}" for name, value in goal_fields(goal).items())
