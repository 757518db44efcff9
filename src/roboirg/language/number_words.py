"""Numbers in words, and nouns in the plural."""

from __future__ import annotations

from collections.abc import Sequence

from roboirg.core.goal_slots import MOMENTS

CARDINALS = (
    "zero", "one", "two", "three", "four", "five", "six", "seven", "eight", "nine", "ten",
)  # fmt: skip
ORDINALS = (
    "zeroth", "first", "second", "third", "fourth", "fifth", "sixth", "seventh", "eighth", "ninth",
    "tenth",
)  # fmt: skip
ADVERBS = {1: "once", 2: "twice"}


def agreeing_number(values: Sequence[str | int]) -> int:
    """Return the number that decides between singular and plural words for some values.

    A single number is itself, ``[3]`` -> 3; other values are counted, ``["red"]`` -> 1 and
    ``["red", "blue"]`` -> 2. Moments also choose between two wordings: the first one gives 1, the
    second one 2.
    """
    if len(values) != 1:
        return len(values)
    (value,) = values
    if isinstance(value, int):
        return value
    if value in MOMENTS:
        return MOMENTS.index(value) + 1
    return 1


def plural(noun: str) -> str:
    """Return the plural of a noun: ``cube`` -> ``cubes``, ``pass`` -> ``passes``."""
    return f"{noun}es" if noun.endswith(("s", "x")) else f"{noun}s"


def cardinal(number: int) -> str:
    """Return a number from 0 to 10 as a word."""
    return CARDINALS[number]


def ordinal(number: int) -> str:
    """Return a position from 1 to 10 as a word: ``first``, ``second``, etc."""
    return ORDINALS[number]


def times(number: int) -> str:
    """Return a number of repetitions in words: ``once``, ``twice``, ``three times``, etc."""
    return ADVERBS.get(number, f"{cardinal(number)} times")
