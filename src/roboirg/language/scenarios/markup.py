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
from roboirg.language.scenarios.written import shown

Operation = Literal[
    "same", "rank", "other", "without", "minus", "plus", "double", "half", "earlier", "later",
    "before", "after", "neighbor", "place", "seen",
]  # fmt: skip
"""How a value follows from what a pointer stands for."""

MOST_LETTERS = 2_000
"""Of a sentence."""
_NAME = r"(?:rival )?[a-z]+(?:\.\d)?"
"""A regular expression for a slot: ``color``, ``list.0``, ``rival color``."""
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
    """Return the parts of a sentence: of ``Lift <it color: it>.`` words, a pointer and a stop.

    Marks are slots for values, ``{color}``, pointers, which point back at a value, and words in
    singular and plural.

    Raises:
        ValueError: it is none, or it has a bracket that is none of the marks.
    """
    sentence = _checked_sentence(text)
    parts: list[Part] = []
    end = 0
    for mark in _MARK.finditer(sentence):
        parts += _plain_words(sentence, end, mark.start())
        parts.append(_parsed(mark))
        end = mark.end()
    parts += _plain_words(sentence, end, len(sentence))
    return tuple(parts)


def _checked_sentence(text: object) -> str:
    """Return a text as it is; raise ValueError if it cannot be a sentence.

    A sentence is printable ASCII on one line, and not too long.
    """
    if isinstance(text, str) and len(text) > MOST_LETTERS:
        raise ValueError(
            f"has words of {len(text):,} characters, {shown(text)}; at most {MOST_LETTERS:,} are "
            "one sentence"
        )
    if not isinstance(text, str) or not text.isascii() or not text.isprintable():
        raise ValueError(f"has the words {shown(text)}; they must be printable ASCII on one line")
    return text


def _plain_words(sentence: str, start: int, end: int) -> list[TaggedText]:
    """Return the words from one mark to the next as a list of one; empty if there are none.

    Raises ValueError for a bracket that belongs to no mark.
    """
    words = sentence[start:end]
    if _BRACKET.search(words):
        raise ValueError(
            f"has a bracket that is no mark in {shown(sentence)}; marks are like {{color}}, "
            "{repeats:lap}, <it color: it> and [repeats: lap|laps]"
        )
    return [TaggedText(words)] if words else []


def _parsed(mark: re.Match[str]) -> Part:
    """Return the part of a sentence for a mark that was found in it."""
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
