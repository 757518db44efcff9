"""The definition of a slot type: how every setting speaks of its values."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

from roboirg.core.goal_slots import SlotTypeName
from roboirg.core.word_pools import Pools
from roboirg.language.phrases import Phrase, anaphor, fill, plain
from roboirg.language.request import GoalValues, InstructionRequest

Fields = dict[str, Phrase]
"""Words for the fields of a command."""
SaysFields = Callable[[InstructionRequest, GoalValues], Fields]
SaysPhrase = Callable[[InstructionRequest, GoalValues], Phrase]
SaysRemarks = Callable[[InstructionRequest, GoalValues], list[Phrase]]
"""Return words for the values of a type."""


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
    stated: SaysFields
    reduced: SaysFields
    introduce: SaysPhrase
    pointing: SaysPhrase
    reinforcements: Pools[str]
    competing: SaysRemarks
    plural: Callable[[InstructionRequest, GoalValues], bool] = lambda _request, goal_values: (
        len(goal_values) > 1
    )
    described: Callable[[InstructionRequest, GoalValues, Sequence[Phrase]], Fields] | None = None


def pointing_at(noun: str) -> SaysPhrase:
    """Return what points at the first value of a type: *that number* for the noun ``number``."""
    return lambda _request, goal_values: anaphor(f"that {noun}", "that", goal_values[0])


def competing_with(
    templates: Pools[str], words: Mapping[str, str] | Mapping[int, str]
) -> SaysRemarks:
    """Return what fills every template with the words of every value that is not the goal's."""
    return lambda request, goal_values: [
        fill(template, {"other": plain(word)}, plural=value != 1)
        for value, word in words.items()
        if value not in {one.value for one in goal_values}
        for template in templates.of(request.pool)
    ]
