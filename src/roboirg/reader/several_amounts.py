"""Amounts of several colors at once: *exactly those*, *half as many of each*."""

from __future__ import annotations

import re
from collections.abc import Collection, Iterator
from typing import NamedTuple

from roboirg.reader.phrases import Phrases
from roboirg.reader.quantities import CountExpression
from roboirg.reader.tokens import COLOR, NUMBER, number_of

_THOSE = Phrases({"exactly those": r"\b(?:exactly|just|precisely) (?:those|these)\b"})
_EACH = Phrases({
    "half as many of each as four red and six green cubes":
        rf"\b(?:(?P<step>{NUMBER}) (?P<way>more|fewer)|(?P<factor>twice|half) as many) of each\b"
        rf"(?: (?:than|as) (?P<named>(?:(?:, |and )?{NUMBER} {COLOR} (?:cubes? ?)?)+))?",
})  # fmt: skip
_AMOUNT = Phrases({"four red and six green cubes": rf"(?P<number>{NUMBER}) (?P<color>{COLOR})"})
_FACTORS = {"twice": 2.0, "half": 0.5}


class SeveralAmounts(NamedTuple):
    """Words for the amounts of all colors that the context introduces.

    Attributes:
        expression: how each number follows from the introduced one.
        amounts: colors and numbers that the words name; empty for those of the context.
    """

    expression: CountExpression
    amounts: tuple[tuple[str, int], ...] = ()

    def results(self, introduced: tuple[tuple[str, int], ...]) -> list[tuple[str, set[int]]]:
        """Return each color with its possible numbers if the context introduces these amounts."""
        return [
            (color, self.expression.results([number]) or set())
            for color, number in self.amounts or introduced
        ]

    def leaves_open(self, numbers: Collection[int]) -> bool:
        """Return whether these numbers, one for each color, are possible without a context."""
        results = self.expression.results(())
        if results is None:
            return sum(numbers) > 1  # "those" are several cubes
        return len(numbers) > 1 and set(numbers) <= results


def several_amounts(text: str) -> Iterator[re.Match[str]]:
    """Yield where a text speaks of the amounts of several colors at once."""
    yield from _EACH.finditer(text)
    yield from _THOSE.finditer(text)


def read_several_amounts(text: str) -> SeveralAmounts | None:
    """Return the words of a command for amounts of several colors; None if it has none."""
    found = _EACH.search(text)
    if found is None:
        return SeveralAmounts(CountExpression()) if _THOSE.search(text) else None
    if found["factor"]:
        expression = CountExpression(factor=_FACTORS[found["factor"]])
    else:
        step = number_of(found["step"]) or 0
        expression = CountExpression(offset=step if found["way"] == "more" else -step)
    named = _AMOUNT.finditer(found["named"] or "")
    amounts = tuple((one["color"], number_of(one["number"]) or 0) for one in named)
    return SeveralAmounts(expression, amounts)
