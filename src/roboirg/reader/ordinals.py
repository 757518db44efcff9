"""Ordinals: an element of a series, named, pointed at, or derived from another element."""

from __future__ import annotations

import re
from collections.abc import Collection
from typing import Literal, NamedTuple

from roboirg.reader.phrases import Phrases
from roboirg.reader.quantities import ADVERBS, CountExpression, read_value
from roboirg.reader.tokens import NUMBER, ORDINAL, number_of, ordinal_of

Base = int | Literal["that", "last", "other"]

_NOUN = r"(?:visit|placement|pass|passage|stay|time|occasion|placing)"
_ELEMENT = Phrases({
    "during the third visit": rf"\b(?P<ordinal>{ORDINAL}|last|final) (?:\w+ )?{_NOUN}\b",
    "during visit number 3":
        rf"\b{_NOUN} (?:number |no )?(?P<number>{NUMBER})\b(?! (?:after|before|visits|placements))",
})  # fmt: skip
_LIST = Phrases({
    "the second, fourth and third visit":
        rf"\b(?:{ORDINAL}(?: (?:,|and|or|, and|, or))?(?: the| its)? )+{_NOUN}s?\b",
    "his on its third": rf"\b(?:its|(?:on|at|during|for) the) {ORDINAL}(?= ,|$)",
})  # fmt: skip
"""The noun goes with all; in the second, it was said before."""
_ORDINAL = Phrases({"third": rf"\b{ORDINAL}\b"})
_ACTS = (
    "reache[sd]|arrive[sd]|passe[sd]|stop(?:s|ped)|move[sd]|goes|went|enter(?:s|ed)|return(?:s|ed)"
)
_BASE = Phrases({
    "that": rf"\s*(?P<that>that|it|this)\b(?! (?:is|was|has|{_ACTS})\b)",
    "the fourth": rf"\s*(?:the |its )?(?P<ordinal>{ORDINAL}|last|final)\b",
    "number 4": rf"\s*(?:(?:the )?{_NOUN} )?(?:number )?(?P<number>{NUMBER})\b",
})  # fmt: skip
"""What a step, or a neighbor, counts from; the words after those of the step."""
_STEP = Phrases({
    "during the visit two before the fourth":
        rf"\b(?:(?P<step>right|just|directly|immediately|{NUMBER})(?: {_NOUN}s?)? )?"
        r"(?P<way>after|before|following|preceding|later than|earlier than|behind|ahead of)\b"
        r"(?! (?:the )?(?:button|press|pressing|placing|taking))",
})  # fmt: skip
_NEXT = Phrases({
    "during the very next one":
        rf"\bthe (?:very )?(?P<way>next|following|previous|preceding) (?:one|{_NOUN})\b",
})  # fmt: skip
_NEIGHBOR = Phrases({
    "the placement that is a neighbor of that":
        r"\b(?:neighbor\w* (?:of|to)|adjacent to|next to|(?:just |right )?before or after"
        r"|(?:closest|nearest) in time to)\b",
})  # fmt: skip
_PENULTIMATE = Phrases({
    "its second to last visit": rf"\b(?P<rank>{ORDINAL}|next) (?:to|from) (?:the )?last\b",
    "its penultimate visit": r"\bpenultimate\b",
})  # fmt: skip
_WAITED = Phrases({
    "after it has passed three times, stop it":
        r"\b(?:let|allow|wait|after|once|until|when)\b "
        r"(?:(?!stop|press|push|hit|halt)[\w']+ ){1,8}?"
        rf"(?:(?P<times>{NUMBER}) (?:times?|passes|visits)(?! (?:later|earlier|before|after)\b)"
        r"|(?P<adverb>once|twice|thrice))\b",
})  # fmt: skip
"""How many visits pass before the one that is meant."""
_BARE = Phrases({
    "on the first of the two targets":
        rf"\b(?P<of>{ORDINAL}|last) of (?:the|these|those|all|its)? ?(?:{NUMBER} )?"
        r"(?:targets|discs|placements|visits)\b",
    "where the robot first put the cube": rf"\b(?P<when>{ORDINAL}|last) (?:put|placed|set|laid)\b",
    "the target used last": rf"\b(?:used|put|visited) (?P<used>{ORDINAL}|last)\b(?! of)",
    "to last target": rf"\b(?P<at>{ORDINAL}|last) (?:target|disc)\b",
    "the target of the later one": r"\bthe (?P<later>later|earlier) (?:one|of the two)\b",
    "the target on which it was placed third":
        rf"\b(?:its|the|placed) (?P<ordinal>{ORDINAL}|last)\b(?! of (?:them|those|these)\b)",
})  # fmt: skip
_POINTER = Phrases({
    "during that very visit": rf"\b(?:that|this|the same) (?:very )?(?:one|number|{_NOUN})\b",
    "during the visit I mentioned": rf"\bthe {_NOUN} i\b",
    "stop the cube then": r"\b(?:target|disc|cube|it) then(?= by\b| ,|$)|\bat that point\b",
})  # fmt: skip
_OTHER = Phrases({
    "during the other visit": rf"\bthe (?:other|remaining) {_NOUN}\b",
    "during the other of the two visits":
        rf"\bthe other (?:one )?of (?:the two|those|these|them) {_NOUN}s?\b",
    "on the other one": r"\bon the other(?: one)?(?: of the two)?(?= (?:by|and|,)|$)",
    "during the visit that is left": rf"\bthe {_NOUN} that is left\b",
    "during the visit other than that":
        rf"\bthe {_NOUN} (?:of (?:the two|them|those) )?other than that\b",
})  # fmt: skip
_RANKS: dict[str, Base] = {"earlier": 1, "later": "last"}
_LATER = ("after", "following", "later than", "behind", "next")


class OrdinalExpression(NamedTuple):
    """A description of an element of a series.

    Attributes:
        base: the number of an element; ``that`` for an introduced one, ``other`` for the other of
            two introduced ones, ``last`` for the last.
        offsets: the possible distances from the base to the element.
        value: an expression for the number of the element, instead of base and offsets.
    """

    base: Base = "that"
    offsets: tuple[int, ...] = (0,)
    value: CountExpression | None = None

    def results(
        self, positions: Collection[int], numbers: Collection[int], length: int
    ) -> set[int] | None:
        """Return the numbers of the possible elements of a series; None for any element.

        `positions` and `numbers` are the elements and the numbers that the context introduces.
        """
        elements = set(range(1, length + 1))
        if self.value is not None:
            values = self.value.results(numbers or positions)
            return None if values is None else values & elements
        bases = self._bases(positions or numbers, length)
        if not bases and self.base in ("that", "other"):
            if self.offsets == (0,):
                return None
            bases = elements
        # An element outside the series has no neighbors.
        return {base + offset for base in bases & elements for offset in self.offsets} & elements

    def _bases(self, introduced: Collection[int], length: int) -> set[int]:
        if self.base in ("that", "other"):
            return set(introduced)
        return {length if isinstance(self.base, str) else self.base}

    @property
    def points(self) -> bool:
        """Whether the context must introduce an element or a number."""
        if self.value is not None:
            return self.value.quantity is None
        return self.base in ("that", "other")


def named_positions(text: str) -> tuple[int, ...]:
    """Return the elements of a series that a sentence names by number, in order."""
    named = [(found.start(), _number(found)) for found in _ELEMENT.finditer(text)]
    for listed in _LIST.finditer(text):
        named += [
            (listed.start() + one.start(), ordinal_of(one[0]) or 0)
            for one in _ORDINAL.finditer(listed[0])
        ]
    # The last one of a list is found twice.
    return tuple(number for _, number in sorted(set(named)) if isinstance(number, int))


def read_position(text: str) -> OrdinalExpression | None:
    """Return the description of an element of a series; None if there is none."""
    value = read_value(text)
    if value is not None:
        return OrdinalExpression(value=value)
    return _read_penultimate(text) or _read_relative(text) or _read_named(text)


def _read_relative(text: str) -> OrdinalExpression | None:
    waited = _WAITED.search(text)
    if waited and _ELEMENT.search(text) is None:
        times, adverb = waited["times"], waited["adverb"]
        return OrdinalExpression(ADVERBS[adverb] if adverb else number_of(times) or 0, (1,))
    # Before `_STEP`, which would take the "one" of "the preceding one" for a number.
    following = _NEXT.search(text)
    if following:
        return OrdinalExpression("that", (1 if following["way"] in _LATER else -1,))
    for found in _NEIGHBOR.finditer(text):
        base = _base(text, found.end())
        if base is not None:
            return OrdinalExpression(base, (-1, 1))
    for found in _STEP.finditer(text):
        base = _base(text, found.end())
        if base is not None:
            step = number_of(found["step"] or "") or 1
            return OrdinalExpression(base, (step if found["way"] in _LATER else -step,))
    return None


def _read_penultimate(text: str) -> OrdinalExpression | None:
    """Read *third to last*, and *next to last* or *penultimate* for the second to last."""
    found = _PENULTIMATE.search(text)
    if found is None:
        return None
    return OrdinalExpression("last", (1 - (ordinal_of(found["rank"] or "") or 2),))


def _read_named(text: str) -> OrdinalExpression | None:
    if _OTHER.search(text):
        return OrdinalExpression("other")
    found = _ELEMENT.search(text)
    if found is None and not _POINTER.search(text):
        found = _BARE.search(text)
        rank = next(filter(None, found.groups())) if found else None
        return OrdinalExpression(_RANKS.get(rank) or _ordinal(rank)) if rank else None
    return OrdinalExpression("that" if found is None else _number(found))


def _base(text: str, at: int) -> Base | None:
    found = _BASE.match(text, at)
    if found is None:
        return None
    return "that" if found["that"] else _number(found)


def _number(found: re.Match[str]) -> Base:
    if found["ordinal"]:
        return _ordinal(found["ordinal"])
    return number_of(found["number"]) or 0


def _ordinal(word: str) -> Base:
    return ordinal_of(word) or "last"
