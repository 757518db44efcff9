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
from roboirg.language.scenarios.written import excerpt

Operation = Literal[
    "same", "rank", "other", "without", "minus", "plus", "double", "half", "earlier", "later",
    "before", "after", "neighbor", "place", "seen",
]  # fmt: skip
"""How a value follows from what a pointer stands for."""

MOST_LETTERS = 2_000
"""Of a sentence."""
_NAME = r"(?:rival )?[a-z]+(?:\.\d)?"
"""A regular expression for the name of a slot: ``color``, ``list.0``, ``rival color``."""
_SLOT = re.compile(rf"\{{(?P<name>{_NAME})(?::(?P<form>[a-z -]+))?\}}")
_AGREEMENT = re.compile(rf"\[(?P<controller>{_NAME}): ?(?P<one>[^\[\]|]*)\|(?P<many>[^\[\]|]*)\]")
_POINTER = re.compile(rf"<(?P<expression>[a-z]+) (?P<of>{_NAME}): (?P<words>[^<>]+)>")
_MARK = re.compile(f"{_POINTER.pattern}|{_SLOT.pattern}|{_AGREEMENT.pattern}")
_BRACKET = re.compile(r"[{}<>\[\]|]")


class Slot(NamedTuple):
    """A place in a sentence where a value is said: ``{repeats:times}``.

    Attributes:
        name: of the slot, ``repeats``.
        form: how it is said, ``times``; None for the usual form of its type.
    """

    name: str
    form: str | None = None


class Agreement(NamedTuple):
    """Words in the singular or plural: ``[repeats: lap|laps]``.

    Attributes:
        controller: the slot that decides, ``repeats``.
        one: for a single thing, *lap*.
        many: for several, *laps*.
    """

    controller: str
    one: str
    many: str


Part = Union[TaggedText, Slot, Agreement, "Pointer"]
Text = tuple[Part, ...]
"""A sentence, parsed."""


class Pointer(NamedTuple):
    """Words that point back at a value (an anaphor): ``<it color: it>``.

    Attributes:
        expression: their class, ``it``; ``rank`` for a position in a list, whatever it is.
        of: the slot that they stand for, ``color``.
        words: as written, marks included.
        parts: the same, parsed.
        resolved: the text that replaces them in the resolved form, parsed; empty for the value.
        operation: how the value follows from that of the slot; ``same`` until the table of pointers
            has been asked (`scenario_file`).
    """

    expression: str
    of: str
    words: str
    parts: Text
    resolved: Text = ()
    operation: Operation = "same"


def parse(text: object) -> Text:
    """Return the parts of a sentence, in order.

    ``Lift <it color: it>.`` gives words, ``Pointer("it", "color", "it", …)`` and words. Other marks
    are slots for values, ``{color}``, and words in singular and plural, ``[repeats: lap|laps]``.

    Raises:
        ValueError: it is no text, not one line of printable ASCII, too long, or has a bracket that
            belongs to no mark. The message goes on after the name of the sentence: *has a bracket
            …*.
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
    """Return a text of a file as it is, if it can be a sentence.

    Raises:
        ValueError: it is no text, not printable ASCII on one line, or too long.
    """
    if isinstance(text, str) and len(text) > MOST_LETTERS:
        raise ValueError(
            f"has words of {len(text):,} characters, {excerpt(text)}; at most {MOST_LETTERS:,} are "
            "one sentence"
        )
    if not isinstance(text, str) or not text.isascii() or not text.isprintable():
        raise ValueError(f"has the words {excerpt(text)}; they must be printable ASCII on one line")
    return text


def _plain_words(sentence: str, start: int, end: int) -> list[TaggedText]:
    """Return the words from one mark of a sentence to the next: a list of one, or empty.

    Args:
        sentence: with its marks.
        start: index of the first character after a mark.
        end: index of the first character of the next mark.

    Raises:
        ValueError: there is a bracket, which then belongs to no mark.
    """
    words = sentence[start:end]
    if _BRACKET.search(words):
        raise ValueError(
            f"has a bracket that is no mark in {excerpt(sentence)}; marks are like {{color}}, "
            "{repeats:lap}, <it color: it> and [repeats: lap|laps]"
        )
    return [TaggedText(words)] if words else []


def _parsed(mark: re.Match[str]) -> Part:
    """Return the part of a sentence for a mark of it: a `Slot` for ``{color}``."""
    if mark["expression"]:
        return Pointer(mark["expression"], mark["of"], mark["words"], parse(mark["words"]))
    if mark["name"]:
        return Slot(mark["name"], mark["form"])
    return Agreement(mark["controller"], mark["one"], mark["many"])


def slots_said(text: Text) -> Iterator[Slot]:
    """Yield the slots of a sentence that name a value, so not those in its pointers.

    ``{person} likes <it color: it>.`` has the slot ``person``.
    """
    return (part for part in text if isinstance(part, Slot))


def pointers_in(text: Text) -> Iterator[Pointer]:
    """Yield the pointers of a sentence, the words that point back: ``<it color: it>``."""
    return (part for part in text if isinstance(part, Pointer))


def slots_in(text: Text) -> Iterator[str]:
    """Yield the names of all slots of a sentence: said, agreed with or pointed at.

    ``{person} has [repeats: a lap|laps], lift <it color: it>.`` gives ``person``, ``repeats``,
    ``color``. A name may come several times.
    """
    for part in text:
        if isinstance(part, Slot):
            yield part.name
        elif isinstance(part, Agreement):
            yield part.controller
        elif isinstance(part, Pointer):
            yield part.of
            yield from slots_in(part.parts)
