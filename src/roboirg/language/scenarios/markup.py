"""The marks in the sentences of a scenario: slots, pointers and agreement.

=================================  ================================================================
``{color}``, ``{repeats:lap}``     a slot; after the colon a form: ``times``, ``ordinal``, ``or`` …,
                                   or a noun to be counted, *three laps*
``<it color: it>``                 words that point back, after their class and what they stand for
``[repeats: lap|laps]``            singular or plural, by the slot that decides
=================================  ================================================================
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from typing import NamedTuple

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


class Pointer(NamedTuple):
    """Words that point back.

    Attributes:
        expression: their class; ``rank`` for a position in a list, whatever it is.
        of: the slot that they stand for.
        words: as written, marks included.
        parts: the same, parsed.
    """

    expression: str
    of: str
    words: str
    parts: tuple[str | Slot | Agreement, ...]


Part = str | Slot | Agreement | Pointer
Text = tuple[Part, ...]
"""A sentence, parsed."""


def parse(text: str) -> Text:
    """Return the parts of a sentence.

    Raises:
        ValueError: it has a bracket that is none of the marks.
    """
    parts: list[Part] = []
    end = 0
    for mark in _MARK.finditer(text):
        parts.append(text[end : mark.start()])
        parts.append(_parsed(mark))
        end = mark.end()
    parts.append(text[end:])
    for part in parts:
        if isinstance(part, str) and _BRACKET.search(part):
            raise ValueError(
                f"{text!r} has a bracket that is no mark; marks are like {{color}}, "
                "{repeats:lap}, <it color: it> and [repeats: lap|laps]"
            )
    return tuple(part for part in parts if part)


def _parsed(mark: re.Match[str]) -> Part:
    if mark["expression"]:
        inner = tuple(part for part in parse(mark["words"]) if not isinstance(part, Pointer))
        return Pointer(mark["expression"], mark["of"], mark["words"], inner)
    if mark["name"]:
        return Slot(mark["name"], mark["form"])
    return Agreement(mark["controller"], mark["one"], mark["many"])


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
