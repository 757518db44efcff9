"""Text into sentences of lower-case words, and words into numbers."""

from __future__ import annotations

import re

Sentence = tuple[str, ...]

_WORD = re.compile(r"[0-9]+(?:st|nd|rd|th)\b|[a-z]+(?:'[a-z]+)?|[0-9]+|[,;:]")
_SENTENCE_END = re.compile(r"[.!?\n]+")
_SPELLINGS = (
    ("’", "'"),
    ("n't", " not"),
    ("colour", "color"),
    ("neighbour", "neighbor"),
    ("grey", "gray"),
)

_NUMBERS = {
    "zero": 0, "one": 1, "two": 2, "three": 3, "four": 4, "five": 5, "six": 6, "seven": 7,
    "eight": 8, "nine": 9, "ten": 10, "eleven": 11, "twelve": 12,
}  # fmt: skip
_ORDINALS = {
    "first": 1, "second": 2, "third": 3, "fourth": 4, "fifth": 5,
    "1st": 1, "2nd": 2, "3rd": 3, "4th": 4, "5th": 5,
}  # fmt: skip
_COLOR_NAMES = ("red", "green", "blue", "yellow", "gray", "purple")
_COLORS = {word: name for name in _COLOR_NAMES for word in (name, f"{name}s")}

NUMBER = rf"(?:{'|'.join(_NUMBERS)}|[0-9]+)"
"""A regular expression for a cardinal number, in words or digits."""
ORDINAL = rf"(?:{'|'.join(_ORDINALS)})"
"""The same for an ordinal number."""
COLOR = rf"(?:{'|'.join(_COLOR_NAMES)})"
"""The same for a color."""
THING = r"(?:cube|box|tape)"
"""The same for one of the things that have colors; the plural is `THINGS`."""
THINGS = r"(?:cubes|boxes|tapes)"


def word_set(words: str) -> frozenset[str]:
    """The words of a string, for membership tests."""
    return frozenset(words.split())


def split_sentences(text: str) -> tuple[Sentence, ...]:
    """The sentences of a text as words and commas; empty ones are left out.

    American and British spelling, and short forms of *not*, come out alike.
    """
    text = text.lower()
    for variant, usual in _SPELLINGS:
        text = text.replace(variant, usual)
    parts = (tuple(_WORD.findall(part)) for part in _SENTENCE_END.split(text))
    return tuple(part for part in parts if part)


def number_of(word: str) -> int | None:
    """The number that a word or a string of digits names."""
    if word.isascii() and word.isdigit():
        return int(word) if len(word) <= 3 else None  # noqa: PLR2004 (nobody counts higher)
    return _NUMBERS.get(word)


def ordinal_of(word: str) -> int | None:
    """1 for ``first``, 2 for ``second``, ..."""
    return _ORDINALS.get(word)


def color_of(word: str) -> str | None:
    """The color that a word names, as an adjective or a noun."""
    return _COLORS.get(word)


def colors_in(words: Sentence) -> tuple[str, ...]:
    """All colors that a sentence names, in order."""
    return tuple(_COLORS[word] for word in words if word in _COLORS)
