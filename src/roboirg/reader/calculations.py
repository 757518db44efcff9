"""Calculations: a sentence that makes one number of two, *take the difference and add one*."""

from __future__ import annotations

import functools
import re
from collections.abc import Callable, Iterable
from typing import NamedTuple

from roboirg.reader.discourse_context import DiscourseContext
from roboirg.reader.tokens import NUMBER, Sentence, number_of

_LEAD = (
    r"(?:(?:and|so|now|then|first|just|let's) ,? ?|i (?:mean|want)(?: you to)? |i am thinking of "
    r"|(?:my|the) number(?: i (?:want|mean))? is |it is )*"
)
_BEFORE = (
    rf"(?:(?P<step>{NUMBER}) (?P<way>less|fewer|more) than |(?P<scale>half|twice|double)(?: of)? )?"
)
_AFTER = (
    r"(?: ,)?(?: and)?(?: then)?"
    rf"(?: (?P<change>add|plus|subtract|take (?:away|off)|minus) (?P<by>{NUMBER})(?: more)?"
    r"| (?P<scaled>halve|double) (?:it|that|the result))?"
)
_TAKE = "(?:(?:take|use|find|work out) )?"
_BOTH = (
    rf"(?:(?P<left>{NUMBER}) and (?P<right>{NUMBER})"
    r"|(?:them|those|these|the|both)(?: two)?(?: (?:numbers|figures|values|cards|dice))?)"
)
_OF_BOTH = rf"(?: (?:of|between) {_BOTH})?"
Combine = Callable[[int, int], int]
_COMBINATIONS: tuple[tuple[Combine, str], ...] = (
    (lambda first, second: first + second, rf"add (?:up )?{_BOTH}(?: up| together)?"),
    (lambda first, second: first + second, rf"{_TAKE}(?:the|their) (?:total|sum){_OF_BOTH}"),
    (
        lambda first, second: abs(first - second),
        rf"{_TAKE}(?:the|their) (?:difference|gap){_OF_BOTH}",
    ),
    (
        lambda first, second: abs(first - second),
        r"subtract the smaller(?: one| number)? from the (?P<left>larger)(?P<right>)(?: one)?",
    ),
    (max, rf"{_TAKE}the (?:larger|bigger|higher|greater)(?: one| number)?{_OF_BOTH}"),
    (min, rf"{_TAKE}the (?:smaller|lower|lesser)(?: one| number)?{_OF_BOTH}"),
)
"""What is made of two numbers, and the words for it."""
_SENTENCES = tuple(
    (combine, re.compile(f"{_LEAD}{_BEFORE}{words}{_AFTER}")) for combine, words in _COMBINATIONS
)


class ReadCalculation(NamedTuple):
    """A number that follows from two others.

    Attributes:
        combine: makes a number of the two.
        offset: the result is ``factor`` times that number, plus this.
        factor: see `offset`.
        numbers: the two, if the sentence names them.
    """

    combine: Combine
    offset: int
    factor: float
    numbers: tuple[int, ...]

    def result(self, introduced: tuple[int, ...]) -> int | None:
        """Return the number that follows from the two that the context introduces, if it does."""
        numbers = self.numbers or introduced
        if len(numbers) != 2:  # noqa: PLR2004 - the two numbers
            return None
        found = self.factor * self.combine(*numbers) + self.offset
        return int(found) if found.is_integer() else None


@functools.lru_cache(maxsize=8192)
def read_calculation(words: Sentence) -> ReadCalculation | None:
    """Return the calculation that a whole sentence describes; None if it is no calculation."""
    text = " ".join(words)
    for combine, sentence in _SENTENCES:
        found = sentence.fullmatch(text)
        if found is not None:
            named = number_of(found["left"] or ""), number_of(found["right"] or "")
            numbers = tuple(one for one in named if one is not None)
            return ReadCalculation(combine, _offset(found), _factor(found), numbers)
    return None


def _offset(found: re.Match[str]) -> int:
    before, after = number_of(found["step"] or "") or 0, number_of(found["by"] or "") or 0
    before = before if found["way"] == "more" else -before
    return before + (after if found["change"] in ("add", "plus") else -after)


def _factor(found: re.Match[str]) -> float:
    word = found["scale"] or found["scaled"]
    return 1.0 if word is None else 0.5 if word.startswith("hal") else 2.0


def with_calculation(context: DiscourseContext, sentences: Iterable[Sentence]) -> DiscourseContext:
    """Return a context in which the result of the last calculation stands for all numbers."""
    found = [one for words in sentences if (one := read_calculation(words)) is not None]
    if not found:
        return context
    result = found[-1].result(context.numbers)
    return context._replace(numbers=() if result is None else (result,))
