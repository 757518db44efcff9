"""The goals that a task can have at all: its slots, and the values that each may take."""

from __future__ import annotations

import functools
import itertools
from collections.abc import Iterator, Mapping
from typing import NamedTuple

from roboirg.core.episode import Goal, SlotValue, Split, values_in
from roboirg.tasks import get_task
from roboirg.tasks.splits.splits import split_episodes

Value = str | int

SPLIT: Split = "train"
"""Its scenes show what the goals of a task can be."""


class SlotVocabulary(NamedTuple):
    """What a slot may hold.

    Attributes:
        values: every value, in order.
        longest: the largest number of values at a time.
        several: whether the slot holds a sequence of values.
    """

    values: tuple[Value, ...]
    longest: int
    several: bool


GoalVocabulary = Mapping[str, SlotVocabulary]
"""By name of the slot, in the order of the goal's slots."""


@functools.cache
def goal_vocabulary(task: str) -> GoalVocabulary:
    """Return the slots of a task's goals, with all values that occur in any scene of train."""
    found: dict[str, list[SlotValue]] = {}
    for episode in split_episodes([task], [SPLIT]):
        for goal in get_task(task).goals(episode.scene):
            for slot, value in goal.slots:
                found.setdefault(slot, []).append(value)
    return {slot: _vocabulary(set(values)) for slot, values in found.items()}


def _vocabulary(contents: set[SlotValue]) -> SlotVocabulary:
    values = {value for content in contents for value in values_in(content)}
    return SlotVocabulary(
        # Numbers in their order; a slot holds either numbers or words.
        values=tuple(sorted(values, key=lambda value: (isinstance(value, str), value))),
        longest=max(len(values_in(content)) for content in contents),
        several=any(isinstance(content, tuple) for content in contents),
    )


def orders(goal: Goal) -> Iterator[Mapping[str, SlotValue]]:
    """Yield the slots of a goal in every order that means the same.

    Amounts may come in any order: two red cubes and a blue one are a blue one and two red cubes.
    """
    slots = goal.as_mapping()
    if not {"colors", "counts"} <= set(slots):
        yield slots
        return
    for order in itertools.permutations(goal.amounts):
        yield {
            **slots,
            "colors": tuple(color for color, _ in order),
            "counts": tuple(count for _, count in order),
        }
