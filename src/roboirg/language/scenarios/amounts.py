"""The fields of the goal that words leave to their context, and their terms.

Most fields of a command are those of the goal. That of amounts holds several, colors with their
counts: a scenario leaves all of them open, ``<them amounts: them>``, or it states the counts and
leaves the first colors, ``{counts.0} of <them colors.0: them>``. Colors of which it says nothing
are stated after its words: *two of that color and one green one*.
"""

from __future__ import annotations

import functools
from collections.abc import Mapping, Sequence

from roboirg.language.instruction import Term
from roboirg.language.scenarios.declared import (
    ChoosingRemark,
    SaidValues,
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
_NOUNS = ("cube", "one", "one")
"""Of up to three colors that are listed."""


def amount_texts(numbers: str, size: int) -> list[Text]:
    """Return the text for each of some colors in a list: *two red cubes*, *one blue one*."""
    return [amount_text(numbers, at, _NOUNS[at]) for at in range(size)]


@functools.cache  # the same few for every episode
def amount_text(numbers: str, at: int, noun: str = "cube") -> Text:
    """Return a color with its number and a noun, to be filled: *two red cubes*."""
    number = f"{numbers}.{at}"
    return parse(f"{{{number}}} {{colors.{at}}} [{number}: {noun}|{noun}s]")


def stated_counts(words: Text) -> int:
    """Return how many counts words state: 1 for ``{counts.0} of <them colors.0: them>``."""
    return len([slot for slot in slots_said(words) if slot.name.startswith("counts.")])


def hidden_fields(words: Text, fields: Sequence[str]) -> Sequence[str]:
    """Return those of a command's fields whose values its words leave to what was said before.

    *it* leaves all of them; *two of them*, which states a count, leaves ``colors.0``; words that do
    not point back leave none.
    """
    if not any(pointers_in(words)):
        return ()
    counts = stated_counts(words)
    if counts:
        return [f"colors.{at}" for at in range(counts)]
    return fields


def hidden_term(field: str, words: Text, remark: ChoosingRemark | None, said: SaidValues) -> Term:
    """Return the term of a field: how its value follows from what was said before.

    Of *Red or blue? Take the latter.*, the field ``color`` has the second of the listed values.

    Args:
        field: of the goal, which the command leaves to its context.
        words: for the field of the command that holds it, with the words that point back.
        remark: words before the command that have chosen one of a list, if there are any.
        said: what was said before.
    """
    base, _, number = field.partition(".")
    pointer = _pointer_of(field, words)
    numbers_slot = NUMBERS.get(pointer.of)
    if numbers_slot and base == "colors":
        return Term("same", said.operands(field))  # "the same ones": each color as it was said
    if remark:
        return chosen_term(pointer, remark, said)
    if numbers_slot:
        pointer = pointer._replace(of=f"{numbers_slot}.{number or 0}")
    return pointed_term(pointer, said)


def _pointer_of(field: str, words: Text) -> Pointer:
    """Return which of a command's words that point back stand for a field of the goal.

    Next to stated counts, *two of those and one of these*, the first are for ``colors.0`` and the
    second for ``colors.1``. Else the last ones are for all fields. Raises LookupError if there are
    too few.
    """
    pointers = list(pointers_in(words))
    if not stated_counts(words):
        return pointers[-1]
    _, _, number = field.partition(".")
    index = int(number)
    if index >= len(pointers):
        raise LookupError(f"words that point at {field}")
    return pointers[index]
