"""Which fields of the goal a command leaves to what was said before, and how they follow from it.

Most fields of a command, such as ``color``, are those of the goal. One holds several: ``cubes``,
for goals that count cubes, has *amounts*, colors with their counts, such as *2 red and 1 blue*.
Its words leave all of them open, ``<them amounts: them>``, or they state the counts and leave the
first colors open, ``{counts.0} of <them colors.0: them>``. Colors of which they say nothing are
stated after them: *two of that color and one green one*.

``<them amounts: them>`` is a pointer: words that point back (an anaphor), after their class and the
slot that they stand for.
"""

from __future__ import annotations

import functools
from collections.abc import Mapping, Sequence

from roboirg.language.instruction import Term
from roboirg.language.scenarios.declared import (
    ChoosingRemark,
    DiscourseHistory,
    chosen_term,
    pointed_term,
)
from roboirg.language.scenarios.markup import (
    Pointer,
    Text,
    parse,
    pointers_in,
    slots_said,
)

NUMBERS: Mapping[str, str] = {"amounts": "counts", "reference": "reference", "kept": "kept"}
"""What words point back at that has numbers of things in their colors, with the slot of these."""
SLOTS = frozenset({"amounts", "colors", "colors.0", "colors.1", "counts", "counts.0", "counts.1"})
"""Slots of a task whose goals are amounts."""
NOUNS = ("cube", "one", "one")
"""Of up to three colors that are listed: *two red cubes and one blue one*."""


@functools.cache  # the same few for every episode
def amount_text(numbers: str, at: int, noun: str = "cube") -> Text:
    """Return the text that names a color with its number, with slots to be filled.

    ``{counts.0} {colors.0} [counts.0: cube|cubes]`` becomes *two red cubes*.

    Args:
        numbers: the slot of the numbers, ``counts``.
        at: index of the color.
        noun: in the singular.
    """
    number = f"{numbers}.{at}"
    return parse(f"{{{number}}} {{colors.{at}}} [{number}: {noun}|{noun}s]")


def stated_counts(words: Text) -> int:
    """Return for how many colors some words state the count.

    1 for ``{counts.0} of <them colors.0: them>``, *two of them*.
    """
    return len([slot for slot in slots_said(words) if slot.name.startswith("counts.")])


def hidden_fields(words: Text, fields: Sequence[str]) -> Sequence[str]:
    """Return the fields of the goal whose values some words leave to what was said before.

    *it* leaves all of `fields` open; *two of them*, which states a count, leaves ``colors.0``;
    *the red cube*, which does not point back, leaves none.

    Args:
        words: for a field of the command.
        fields: of the goal that this field holds: itself, or colors and counts.
    """
    if not any(pointers_in(words)):
        return ()
    counts = stated_counts(words)
    if counts:
        return [f"colors.{at}" for at in range(counts)]
    return fields


def hidden_term(
    field: str, words: Text, remark: ChoosingRemark | None, history: DiscourseHistory
) -> Term:
    """Return how the value of a field follows from what was said before, as a term to compute.

    After *Red or blue?*, the words *the latter* give the field ``color`` the second of the two:
    ``Term("rank", ("red", "blue"), rank=2)``.

    Args:
        field: of the goal; one of `hidden_fields`.
        words: for the field of the command that holds it; they point back.
        remark: words before the command that have chosen one of a list of two, if there are any.
        history: what was named before.

    Raises:
        LookupError: the words point back too few times.
    """
    base, _, number = field.partition(".")
    pointer = _pointer_of(field, words)
    # The slot of the numbers, if the pointer is for several colors, each with its number.
    numbers_slot = NUMBERS.get(pointer.of)
    if numbers_slot and base == "colors":
        return Term("same", history.operands(field))  # "the same ones": each color as it was said
    if remark:
        return chosen_term(pointer, remark, history)
    if numbers_slot:  # "half as many": of the number of this color
        pointer = pointer._replace(of=f"{numbers_slot}.{number or 0}")
    return pointed_term(pointer, history)


def _pointer_of(field: str, words: Text) -> Pointer:
    """Return which pointer in some words stands for a field of the goal.

    A pointer is words that point back. If counts are stated, *two of those and one of these*, the
    first one is for ``colors.0`` and the second one for ``colors.1``. Else the last one is for all
    fields.

    Raises:
        LookupError: there are too few.
    """
    pointers = list(pointers_in(words))
    if not stated_counts(words):
        return pointers[-1]
    _, _, number = field.partition(".")
    index = int(number)
    if index >= len(pointers):
        raise LookupError(f"words that point at {field}")
    return pointers[index]
