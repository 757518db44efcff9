"""What has to be known about a kind of value to speak of it in every setting."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

from roboirg.language.phrases import Phrase, fill, plain
from roboirg.language.request import GoalValue, InstructionRequest, SlotTypeName

Fields = dict[str, Phrase]
"""Words for the fields of a command."""


@dataclass(frozen=True, slots=True)
class SlotType:
    """One kind of value.

    Attributes:
        name: as in `SlotTypeName`.
        stated: the fields of the command, every value named outright.
        reduced: the same fields with words that point back at the introduced values.
        introduce: a sentence that names the values.
        pointing: the words that a reinforcement uses for the values.
        plural: whether these words are a plural.
        reinforcements: sentences with a field ``{ref}`` for those words.
        rivals: sentences that name values which are not meant.
        described: of a kind that has colors: the fields, given a description of the thing or
            things of each color.
    """

    name: SlotTypeName
    stated: Callable[[InstructionRequest, tuple[GoalValue, ...]], Fields]
    reduced: Callable[[InstructionRequest, tuple[GoalValue, ...]], Fields]
    introduce: Callable[[InstructionRequest, tuple[GoalValue, ...]], Phrase]
    pointing: Callable[[InstructionRequest, tuple[GoalValue, ...]], Phrase]
    reinforcements: tuple[str, ...]
    rivals: Callable[[InstructionRequest, tuple[GoalValue, ...]], list[Phrase]]
    plural: Callable[[tuple[GoalValue, ...]], bool] = lambda parts: len(parts) > 1
    described: Callable[[tuple[GoalValue, ...], Sequence[Phrase]], Fields] | None = None


def rival_sentences(
    templates: Sequence[str],
    values: Sequence[str | int],
    word: Callable[[str | int], str],
    parts: tuple[GoalValue, ...],
) -> list[Phrase]:
    """Every template with every value that the goal does not have."""
    taken = {part.value for part in parts}
    return [
        fill(template, {"other": plain(word(value))}, plural=value != 1)
        for value in values
        if value not in taken
        for template in templates
    ]
