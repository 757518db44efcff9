"""The marks in the sentences of a scenario: slots, pointers and agreement.

=================================  ================================================================
``{color}``, ``{repeats:lap}``     a slot; after the colon a form: ``times``, ``ordinal``, ``or``,
                                   ``spot`` …, or a noun to be counted, *three laps*
``<it color: it>``                 words that point back, after their class and what they stand for
``[repeats: lap|laps]``            singular or plural, by the slot that decides
=================================  ================================================================
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from typing import Literal, NamedTuple, Union

from roboirg.language.phrases import TaggedText

Operation = Literal[
    "same", "rank", "other", "without", "minus", "plus", "double", "half", "earlier", "later",
    "before", "after", "place", "seen",
]  # fmt: skip
"""How a value follows from what a pointer stands for."""

MOST_LETTERS = 2_000
"""Of a sentence."""
_NAME = r"(?:rival )?[a-z]+(?:\.\d)?"
_SLOT = re.compile(rf"\{{(?P<name>{_NAME})(?::(?P<form>[a-z -]+))?\}}")
_AGREEMENT = re.compile(rf"\[(?P<controller>{_NAME}): ?(?P<one>[^\[\]|]*)\|(?P<many>[^\[\]|]*)\]")
_POINTER = re.compile(rf"<(?P<expression>[a-z]+) (?P<of>{_NAME}): (?P<words>[^<>]+)>")
_MARK = re.compile(f"{_POINTER.pattern}|{_SLOT.pattern}|{_AGREEMENT.pattern}")
_BRACKET = re.compile(r"[{}<>\[\]|]")


class Slot(NamedTuple):
    """A value in words.

    Attributes:
        name: of the slot.
        form: how it is said; None for the usual form of its type.
    """

    name: str
    form: str | None = None


class Agreement(NamedTuple):
    """Words that agree with a number.

    Attributes:
        controller: the slot that decides.
        one: for a single thing.
        many: for several.
    """

    controller: str
    one: str
    many: str


Part = Union[TaggedText, Slot, Agreement, "Pointer"]
Text = tuple[Part, ...]
"""A sentence, parsed."""


class Pointer(NamedTuple):
    """Words that point back.

    Attributes:
        expression: their class; ``rank`` for a position in a list, whatever it is.
        of: the slot that they stand for.
        words: as written, marks included.
        parts: the same, parsed.
        resolved: what stands for them in the resolved form; empty for the value.
        operation: how the value follows from that of the slot.
    """

    expression: str
    of: str
    words: str
    parts: Text
    resolved: Text = ()
    operation: Operation = "same"


def parse(text: object) -> Text:
    """Return the parts of a sentence.

    Raises:
        ValueError: it is none, or it has a bracket that is none of the marks.
    """
    if not isinstance(text, str) or not text.isascii() or not text.isprintable():
        raise ValueError(f"has the words {text!r}; they must be printable ASCII on one line")
    if len(text) > MOST_LETTERS:
        raise ValueError(
            f"has words of {len(text):,} characters, {text[:40]!r}; at most {MOST_LETTERS:,} are "
            "one sentence"
        )
    parts: list[Part] = []
    end = 0
    for mark in (*_MARK.finditer(text), None):
        between = text[end : mark.start() if mark else None]
        if _BRACKET.search(between):
            raise ValueError(
                f"has a bracket that is no mark in {text!r}; marks are like {{color}}, "
                "{repeats:lap}, <it color: it> and [repeats: lap|laps]"
            )
        if between:
            parts.append(TaggedText(between))
        if mark:
            parts.append(_parsed(mark))
            end = mark.end()
    return tuple(parts)


def _parsed(mark: re.Match[str]) -> Part:
    if mark["expression"]:
        return Pointer(mark["expression"], mark["of"], mark["words"], parse(mark["words"]))
    if mark["name"]:
        return Slot(mark["name"], mark["form"])
    return Agreement(mark["controller"], mark["one"], mark["many"])


def slots_said(text: Text) -> Iterator[Slot]:
    """Yield the slots that a sentence says outside of its pointers."""
    return (part for part in text if isinstance(part, Slot))


def pointers_in(text: Text) -> Iterator[Pointer]:
    """Yield the pointers of a sentence."""
    return (part for part in text if isinstance(part, Pointer))


def slots_in(text: Text) -> Iterator[str]:
    """Yield the names of the slots that a sentence says, agrees with or points back at."""
    for part in text:
        if isinstance(part, Slot):
            yield part.name
        elif isinstance(part, Agreement):
            yield part.controller
        elif isinstance(part, Pointer):
            yield part.of
            yield from slots_in(part.parts)
