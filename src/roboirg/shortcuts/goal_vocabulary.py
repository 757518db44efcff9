"""The goals that a task can have in any scene: its slots, and the values that each may take."""

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
    """What a slot of a goal, such as ``color``, may hold.

    Attributes:
        values: every value, numbers by size and words by the alphabet.
        longest: the largest number of values that the slot holds at a time.
        is_sequence: whether the slot holds a sequence of values, ``("blue", "red")``, and not a
            single one, ``"red"``.
    """

    values: tuple[Value, ...]
    longest: int
    is_sequence: bool


GoalVocabulary = Mapping[str, SlotVocabulary]
"""The vocabulary of each slot by its name, in the order of the goal's slots."""


@functools.cache
def goal_vocabulary(task: str) -> GoalVocabulary:
    """Return all values that each slot of a task's goals can have, by name of the slot.

    They are found in the goals of all scenes of the train split: PickXtimes -> ``color`` with blue,
    green and red, ``repeats`` with 1 to 5.
    """
    contents: dict[str, set[SlotValue]] = {}
    for episode in split_episodes([task], [SPLIT]):
        for goal in get_task(task).goals(episode.scene):
            for slot, content in goal.slots:
                contents.setdefault(slot, set()).add(content)
    return {slot: _vocabulary(found) for slot, found in contents.items()}


def _vocabulary(contents: set[SlotValue]) -> SlotVocabulary:
    """Return what a slot may hold, given all contents that it has in some goals.

    ``("red",)`` and ``("blue", "red")`` -> the values blue and red, at most two at a time.
    """
    values: set[Value] = set()
    longest = 0
    is_sequence = False
    for content in contents:
        found = values_in(content)
        values.update(found)
        longest = max(longest, len(found))
        if isinstance(content, tuple):
            is_sequence = True
    # A slot holds numbers or words, no mixture; numbers are sorted by their size.
    in_order = sorted(values, key=lambda value: (isinstance(value, str), value))
    return SlotVocabulary(tuple(in_order), longest, is_sequence)


def wordings_of(goal: Goal) -> Iterator[Mapping[str, SlotValue]]:
    """Yield the slots of a goal in every order of values in which the goal can be said.

    Two red cubes and a blue one -> ``colors`` red, blue with ``counts`` 2, 1, then blue, red with
    1, 2. A goal without counts is yielded once, as the order of its values matters.
    """
    slots = goal.as_mapping()
    if not {"colors", "counts"} <= set(slots):
        yield slots
        return
    for amounts in itertools.permutations(goal.amounts):
        colors = tuple(color for color, _ in amounts)
        counts = tuple(count for _, count in amounts)
        yield {**slots, "colors": colors, "counts": counts}
