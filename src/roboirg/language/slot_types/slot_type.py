"""The definition of a slot type: how every setting speaks of its values."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

from roboirg.core.goal_slots import SlotTypeName
from roboirg.core.word_pools import Pools
from roboirg.language.phrases import Phrase, fill, plain
from roboirg.language.request import GoalValue, InstructionRequest

Fields = dict[str, Phrase]
"""Words for the fields of a command."""


@dataclass(frozen=True, slots=True)
class SlotType:
    """One type of goal slots.

    Attributes:
        name: as in `SlotTypeName`.
        stated: returns the fields of the command with every value named.
        reduced: returns the same fields with words that point back at the introduced values.
        introduce: returns a sentence that names the values.
        pointing: returns the words by which a reinforcement refers to the values.
        plural: whether these words are a plural.
        reinforcements: sentences with a field ``{ref}`` for those words.
        competing: returns remarks that name other values.
        described: for types that have colors: returns the fields, given a description of the
            thing or things of each color.
    """

    name: SlotTypeName
    stated: Callable[[InstructionRequest, tuple[GoalValue, ...]], Fields]
    reduced: Callable[[InstructionRequest, tuple[GoalValue, ...]], Fields]
    introduce: Callable[[InstructionRequest, tuple[GoalValue, ...]], Phrase]
    pointing: Callable[[InstructionRequest, tuple[GoalValue, ...]], Phrase]
    reinforcements: Pools[str]
    competing: Callable[[InstructionRequest, tuple[GoalValue, ...]], list[Phrase]]
    plural: Callable[[InstructionRequest, tuple[GoalValue, ...]], bool] = (
        lambda _request, goal_values: len(goal_values) > 1
    )
    described: (
        Callable[[InstructionRequest, tuple[GoalValue, ...], Sequence[Phrase]], Fields] | None
    ) = None


def competing_remarks(
    templates: Sequence[str],
    candidates: Sequence[str | int],
    word: Callable[[str | int], str],
    goal_values: tuple[GoalValue, ...],
) -> list[Phrase]:
    """Fill every template with every candidate that is no value of the goal."""
    taken = {one.value for one in goal_values}
    return [
        fill(template, {"other": plain(word(candidate))}, plural=candidate != 1)
        for candidate in candidates
        if candidate not in taken
        for template in templates
    ]
