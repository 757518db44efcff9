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
from roboirg.language.scenarios.markup import Text, parse, pointers_in, slots_said

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
    """Return how many counts words state."""
    return sum(slot.name.startswith("counts.") for slot in slots_said(words))


def hidden_fields(words: Text, fields: Sequence[str]) -> Sequence[str]:
    """Return those of a command's fields that words leave to their context."""
    if not any(pointers_in(words)):
        return ()
    return [f"colors.{at}" for at in range(stated_counts(words))] or fields


def hidden_term(field: str, words: Text, remark: ChoosingRemark | None, said: SaidValues) -> Term:
    """Return the term of a field that words leave to their context.

    Args:
        field: of the goal.
        words: for the field of the command that holds it.
        remark: what has chosen the value that they point at, if anything has.
        said: what was said before.
    """
    base, _, number = field.partition(".")
    at = int(number) if stated_counts(words) else -1
    pointer = list(pointers_in(words))[at]
    numbers = NUMBERS.get(pointer.of)
    if numbers and base == "colors":
        return Term("same", said.operands(field))
    if remark:
        return chosen_term(pointer, remark, said)
    if numbers:
        pointer = pointer._replace(of=f"{numbers}.{number or 0}")
    return pointed_term(pointer, said)
