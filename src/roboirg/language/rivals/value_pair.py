"""The pairs of an episode: the value that is meant, and others that could be its rival."""

from __future__ import annotations

import functools
from collections.abc import Iterator
from typing import NamedTuple

from roboirg.core.episode import Difficulty, Split, values_in
from roboirg.core.goal_slots import COLOR_SLOTS
from roboirg.language.instruction import REFERENCE
from roboirg.language.request import GoalValue, InstructionRequest
from roboirg.tasks import get_task
from roboirg.tasks.splits.splits import split_episodes

SPLIT: Split = "train"
"""Its goals show which numbers are usual for a difficulty."""
NUMBER_SLOTS = ("repeats", "counts", "visit", "placement")


class ValuePair(NamedTuple):
    """Two values, one of which is meant.

    Attributes:
        meant: a value of the goal; of two colors in order, the one that comes first.
        rival: the other value; its slot is ``reference`` unless the goal has it too.
        slot: the goal slot of the meant value.
    """

    meant: GoalValue
    rival: GoalValue

    @property
    def slot(self) -> str:
        """The goal slot of the meant value."""
        return self.meant.slot

    @property
    def word_kind(self) -> str:
        """The kind of words for the values: a slot type, where a count is a number."""
        return "number" if self.meant.slot == "counts" else self.meant.slot_type

    @property
    def ordered(self) -> bool:
        """Whether the goal has both values, and only their order is open."""
        return self.rival.slot == self.meant.slot


def pair_refusal(request: InstructionRequest) -> str | None:
    """Return why an episode can have no rival; None if it can."""
    if rival_pairs(request):
        return None
    if len(request.values_of("amount")) > 2:  # noqa: PLR2004 - a color and its count
        return "a goal that counts cubes of several colors leaves no rival"
    return "the scene has no second value that the goal could ask for"


def rival_pairs(request: InstructionRequest) -> list[ValuePair]:
    """Draw one of the slots that can have a rival, and return all pairs of its value.

    A color that the video gives away has none: its words would tell nothing.
    """
    found = [
        pair
        for pair in possible_pairs(request)
        if not (pair.slot in COLOR_SLOTS and request.shows_color)
    ]
    if not found:
        return []
    slot = request.sampler.pick("rival slot", list(dict.fromkeys(one.slot for one in found)))
    return [pair for pair in found if pair.slot == slot]


def possible_pairs(request: InstructionRequest) -> Iterator[ValuePair]:
    """Yield a pair for every other value that a goal of the scene has in one slot."""
    goal = request.episode.goal
    if len(request.values_of("amount")) > 2:  # noqa: PLR2004 - a color and its count
        return
    for slot, _ in goal.slots:
        values = request.values_in(slot)
        meant = values[0]
        others = [
            one
            for one in request.alternatives(slot)
            if len(one) == len(values) and one != tuple(value.value for value in values)
        ]
        if len(values) > 1:
            swapped = tuple(one.value for one in reversed(values))
            if swapped in others:
                yield ValuePair(meant, values[1])
            continue
        usual = _usual_numbers(request.task.name, request.episode.difficulty, slot)
        for (value,) in others:
            if slot not in NUMBER_SLOTS or value in usual:
                rival = meant._replace(field="rival", slot=REFERENCE, value=value)
                yield ValuePair(meant, rival)


@functools.cache
def _usual_numbers(task: str, difficulty: Difficulty, slot: str) -> frozenset[str | int]:
    """Return the numbers in goals of a difficulty.

    A rival from all others would be told from them: only hard episodes ask for four or five times.
    """
    return frozenset(
        value
        for episode in split_episodes([get_task(task).name], [SPLIT])
        if episode.difficulty == difficulty
        for value in values_in(episode.goal[slot])
    )
