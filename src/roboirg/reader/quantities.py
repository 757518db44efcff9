"""Quantities: plain numbers, numbers derived from another one, and words that point at one."""

from __future__ import annotations

import functools
import re
from collections.abc import Callable, Iterable
from typing import NamedTuple

from roboirg.reader.phrases import Phrases
from roboirg.reader.tokens import COLOR, NUMBER, THING, THINGS, Sentence, number_of

_CONCEIVABLE = range(1, 11)
"""The values that a quantity may have if no text introduces it."""


class CountExpression(NamedTuple):
    """The number ``factor * quantity + offset``; the context gives a missing quantity.

    A remaining one is the other of two.
    """

    factor: float = 1.0
    offset: int = 0
    quantity: int | None = None
    remaining: bool = False

    @property
    def derived(self) -> bool:
        """Whether the number differs from the quantity."""
        return (self.factor, self.offset) != (1.0, 0)

    def results(self, introduced: Iterable[int]) -> set[int] | None:
        """Return the possible values if the context names these numbers; None for any value."""
        quantities = [self.quantity] if self.quantity is not None else list(introduced)
        if not quantities and not self.derived:
            return None
        results = [self.factor * one + self.offset for one in quantities or _CONCEIVABLE]
        return {int(result) for result in results if result.is_integer()}


class Quantity(NamedTuple):
    """A quantity in a text, and from which character to which it goes."""

    expression: CountExpression
    start: int
    end: int
    plain: bool = False


_NOUNS = rf"(?: (?:times?|{THING}|{THINGS}|ones?|visits?|{COLOR}|such|of|the|them))"
_TO = rf"(?P<quantity>that|it|this|the(?! (?:target|disc|video|button|left|right)\b)|{NUMBER})\b"
_MORE = "more|larger|greater|higher|bigger|above|over"
_LESS = "fewer|less|smaller|lower|below|under"
_STEP = Phrases({
    "two more red cubes than that":
        rf"(?<!\bthe )(?<!red )(?<!green )(?<!blue )"
        rf"\b(?P<step>{NUMBER}){_NOUNS}{{0,3}} (?P<way>{_MORE}|{_LESS}){_NOUNS}{{0,5}}(?: than)? "
        f"{_TO}",
})  # fmt: skip
_PLUS = Phrases({
    "that minus 4":
        rf"\b(?P<quantity>that|it|this|once|twice|thrice|{NUMBER})(?: many)?(?: times)? "
        rf"(?P<way>plus|minus) (?P<step>{NUMBER})",
})  # fmt: skip
_SCALED = Phrases({
    "half as many green cubes as 8":
        rf"\b(?P<factor>twice|double|thrice|triple|half|{NUMBER} times)"
        rf"(?: as (?:many|often|much){_NOUNS}{{0,5}} as| of| the| as)? {_TO}",
})  # fmt: skip
_SAME = Phrases({
    "that many of them": r"\b(?:that|as|this|so|equally) (?:many|often)\b",
    "the same number of blue cubes":
        r"\b(?:that same|that|this|the (?:exact |very )?same) (?:number|amount) of\b",
    "my lucky number of blue cubes":
        r"\b(?:my (?:\w+ )?|the (?:right|correct|chosen|selected|preferred|desired|agreed|final) )"
        r"number of\b",
    "the number of times I mentioned": r"\bthe number of times(?= i\b)",
})  # fmt: skip
_REMAINING = Phrases({
    "the other number of times": r"\bthe other number\b(?: of times)?",
    "the number of times that is left": r"\bthe number(?: of times)? that is left\b",
})  # fmt: skip
_SOME = Phrases({"a couple of red cubes": r"\ba (?:couple|pair) of\b"})
_ADVERB = Phrases({
    "Put it on the target twice.": r"\b(?:once(?! (?:you|it|that|the|all|this))|twice|thrice)\b",
})  # fmt: skip
_NOT_AFTER = (
    "the", "that", "this", "those", "these", "which", "other", "another", "every", "each", "any",
    "some", "no", "first", "second", "third", "last", "than", "as", "from", "red", "green",
    "blue", "yellow", "gray", "purple", "number", "visit", "placement",
)  # fmt: skip
_POINTED = "".join(rf"(?<!\b{word} )" for word in _NOT_AFTER)
"""After one of these words a number word only points: ``those two``, ``the red one``."""
_PLAIN = Phrases({
    "three red cubes": rf"{_POINTED}\b(?P<number>{NUMBER})\b(?! times as)",
    "I say this three times": rf"(?<=\b(?:this|that) )(?P<times>{NUMBER})(?= times\b(?! as))",
    "He picked the number two":
        rf"(?<=\bthe number )(?P<value>{NUMBER})\b(?! (?:visit|placement|times as))",
    "My cat knows that one tap means dinner":
        r"\b(?:know|say|think|bet|mean|agree|hear)\w* that "
        rf"(?P<said>{NUMBER}) (?!times|is\b|was\b|has\b|of\b|and\b|or\b)(?=[a-z])",
})  # fmt: skip
_SINGLE = Phrases({
    "a blue cube":
        r"(?<!\bas )(?<!\bthan )(?<!\bto )(?<!\bfrom )(?<!\bof )(?<!\bhides )(?<!\bover )"
        rf"\b(?:an?|the)(?: single)? (?={COLOR} (?:{THING}|one)\b)",
})  # fmt: skip
_FACTORS = {"twice": 2.0, "double": 2.0, "thrice": 3.0, "triple": 3.0, "half": 0.5}
ADVERBS = {"once": 1, "twice": 2, "thrice": 3}
"""Numbers of repetitions in one word."""
_TIMES = Phrases({"three times": r" (?:times?|rounds?|turns?|occasions?|cycles?)\b"})
"""What follows a number of repetitions."""

Reading = tuple[Phrases, Callable[[re.Match[str]], CountExpression], bool]


def _stepped(found: re.Match[str]) -> CountExpression:
    sign = 1 if re.fullmatch(f"{_MORE}|plus", found["way"]) else -1
    return _expression(found, offset=sign * (number_of(found["step"]) or 0))


def _scaled(found: re.Match[str]) -> CountExpression:
    factor = _FACTORS.get(found["factor"]) or float(number_of(found["factor"].split()[0]) or 1)
    return _expression(found, factor=factor)


def _expression(found: re.Match[str], *, factor: float = 1.0, offset: int = 0) -> CountExpression:
    """Return the expression for a quantity that a text names or points at."""
    quantity = found["quantity"]
    return CountExpression(factor, offset, ADVERBS.get(quantity) or number_of(quantity))


_DERIVED: tuple[Reading, ...] = ((_STEP, _stepped, False), (_PLUS, _stepped, False),
                                 (_SCALED, _scaled, False))  # fmt: skip
_READINGS: tuple[Reading, ...] = (
    *_DERIVED,
    (_REMAINING, lambda _found: CountExpression(remaining=True), False),
    (_SAME, lambda _found: CountExpression(), False),
    (_SOME, lambda _found: CountExpression(quantity=2), True),
    (_ADVERB, lambda found: CountExpression(quantity=ADVERBS[found[0]]), True),
    (
        _PLAIN,
        lambda found: CountExpression(quantity=number_of(next(filter(None, found.groups())))),
        True,
    ),
    (_SINGLE, lambda _found: CountExpression(quantity=1), True),
)
"""Phrases, reader, and whether it is a plain number; of two that overlap, the first one counts."""


@functools.lru_cache(maxsize=8192)
def quantities(text: str) -> tuple[Quantity, ...]:
    """Return all quantities of a sentence, in order."""
    found: list[Quantity] = []
    for phrases, read, plain in _READINGS:
        for match in phrases.finditer(text):
            start, end = match.span()
            if all(end <= one.start or one.end <= start for one in found):
                found.append(Quantity(read(match), start, end, plain))
    return tuple(sorted(found, key=lambda one: one.start))


_SOMEBODY = Phrases({"One doctor says": rf"^one(?! (?:times?|{COLOR}|{THING}|and|or|is|was)\b) \w"})


def plain_numbers(words: Sentence) -> tuple[int, ...]:
    """Return the plain numbers of a sentence: *three times*, *twice*."""
    text = " ".join(words)
    found = [
        (match.start(), number_of(next(filter(None, match.groups()))))
        for match in _PLAIN.finditer(text)
        if match.start() or _SOMEBODY.search(text) is None
    ]
    found += [(match.start(), ADVERBS[match[0]]) for match in _ADVERB.finditer(text)]
    return tuple(number for _, number in sorted(found) if number is not None)


def read_value(text: str) -> CountExpression | None:
    """Return the first derived number: ``one less than that``."""
    return next((one.expression for one in quantities(text) if one.expression.derived), None)


def times_mentions(text: str) -> list[Quantity]:
    """Return the numbers of repetitions of a text, those that point or derive one first."""
    found = quantities(text)
    plain = [one for one in found if one.plain]
    times = [one for one in found if not one.plain]
    return times + [
        one for one in plain if text[one.start : one.end] in ADVERBS or _TIMES.match(text, one.end)
    ]


def read_times(text: str) -> CountExpression | None:
    """Return the number of repetitions; None if the text gives none."""
    times = times_mentions(text)
    return times[0].expression if times else None
