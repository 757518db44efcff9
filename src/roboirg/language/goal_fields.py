"""The values of a goal, each under the name of its field, and the goal's name in records."""

from __future__ import annotations

from collections.abc import Iterator

from roboirg.core.episode import Goal, values_in


def goal_fields(goal: Goal) -> dict[str, str]:
    """Return the value of each field that states a goal: ``{"color": "red", "repeats": "3"}``.

    A color with a count is one field, ``cubes.0``, with a value such as ``"2 red"``.
    """
    slots = goal.as_mapping()
    if "counts" in slots:
        return {f"cubes.{at}": f"{count} {color}" for at, (color, count) in enumerate(goal.amounts)}
    return {name: str(value) for slot in slots for name, value in fields_of(goal, slot)}


def fields_of(goal: Goal, slot: str) -> Iterator[tuple[str, str | int]]:
    """Yield the value of each field for a slot, with an index if the slot has several."""
    several = isinstance(goal[slot], tuple)
    for at, one in enumerate(values_in(goal[slot])):
        yield f"{slot}.{at}" if several else slot, one


def goal_name(goal: Goal) -> str:
    """Return the name that records have for a goal: ``color red, repeats 3``.

    It stays as it is, because records that were published are compared with it.
    """
    return ", ".join(f"{name} {value}" for name, value in goal_fields(goal).items())
