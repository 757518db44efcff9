"""The goals that a task can have in any scene: its slots, and the values that each may take."""

from __future__ import annotations

import functools
import itertools
from collections.abc import Mapping
from typing import NamedTuple

from roboirg.core.episode import SlotValue, Split, values_in
from roboirg.tasks import goals_of
from roboirg.tasks.splits.splits import split_episodes

Value = str | int

SPLIT: Split = "train"
"""Its scenes show what the goals of a task can be."""


class SlotVocabulary(NamedTuple):
    """What a slot of a goal, such as ``color``, may hold.

    Attributes:
        values: every value, numbers by size and words by the alphabet.
        longest: the largest number of values that the slot holds at a time.
    """

    values: tuple[Value, ...]
    longest: int


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
        for goal in goals_of(episode):
            for slot, content in goal.slots:
                contents.setdefault(slot, set()).add(content)
    return {slot: _vocabulary(found) for slot, found in contents.items()}


def _vocabulary(contents: set[SlotValue]) -> SlotVocabulary:
    """Return what a slot may hold, given all contents that it has in some goals.

    ``("red",)`` and ``("blue", "red")`` -> the values blue and red, at most two at a time.
    """
    found = [values_in(content) for content in contents]
    values = set(itertools.chain.from_iterable(found))
    # A slot holds numbers or words, no mixture; numbers are sorted by their size.
    in_order = sorted(values, key=lambda value: (isinstance(value, str), value))
    return SlotVocabulary(tuple(in_order), longest=max(map(len, found)))
