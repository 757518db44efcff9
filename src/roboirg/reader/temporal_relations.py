"""Moments: before or after the button press, and before or after things change places."""

from __future__ import annotations

import re
from collections.abc import Collection
from typing import Literal, NamedTuple

from roboirg.core.conditions import Fact
from roboirg.reader.phrases import Phrases

PressRelation = Literal["before", "after"]
Time = Literal["at first", "at last"]
MOMENTS: tuple[PressRelation, PressRelation] = ("before", "after")

_PRESS = Phrases({
    "before the button was pressed":
        r"\b(?:press|pressed|presses|pressing|push|pushed|pushing|button)\b",
})  # fmt: skip
_WORD: dict[str, PressRelation] = {
    "before": "before", "prior to": "before", "preceding": "before", "preceded": "before",
    "after": "after", "following": "after", "followed": "after",
}  # fmt: skip
_NAMED = Phrases({
    "before the button was pressed":
        r"\b(before|prior to|preceding|preceded|after|following|followed)\b"
        r"(?! (?:that|this|which|watching|seeing|(?:the|this) (?:video|demonstration))\b)",
})  # fmt: skip
_EITHER_SIDE = r"\b(?:just |right )?before or after\b"
_NEIGHBOR = Phrases({
    "at the placement next to that": r"\b(?:neighbor\w*|adjacent|next to|beside)\b",
    "at the placement right before or after that": _EITHER_SIDE,
    "at the placement closest in time to that": r"\b(?:closest|nearest) in time to\b",
})  # fmt: skip
NOT_THAT = r"\bnot (?:at |in )?(?:that|this|it|the one|the moment|when)\b(?! pair| on)"
"""A regular expression for ``not at that moment``."""
NOT_NAMED = r"\bnot (?:the |one |right |just |moment |at |directly )*(before|after)\b"
"""A regular expression for ``not the one right before the press``; a group has the moment."""
_OTHER = Phrases({
    "at the other of the two moments":
        r"(?<!\bcolor )(?<!\bthem )(?<!\btwo )\bother (?:one |moment )?"
        r"(?:of|moment|time|point|than)\b"
        r"(?! (?:the two|those|these|them|of)? ?(?:cube|box|tape|color)(?:e?s)?\b)",
    "I named one moment; put it where it was at the other one.":
        r"\b(?:at|in|during) the other one\b",
    "not at that moment": NOT_THAT,
    "at whichever he would not choose": r"\bwhichever\b.*\bnot\b",
})  # fmt: skip
_NOT = Phrases({"when it was not before but after the press": NOT_NAMED})
_POINTER = Phrases({
    "at that very moment":
        r"\b(?:that|this|the same) (?:very )?(?:moment|time|point|instant|part|placement|one)\b",
    "at the moment I chose": r"\bthe moment i\b",
    "where it was then": r"\bthen\b(?! (?:press|take|put|place|set|to|go|pick|lift|push)\b)",
})  # fmt: skip

_MOVED = r"(?:moved?|moves|moving|swapped|changed|exchanged|shuffled|started|began)"
_SUBJECT = r"(?:(?:any|every|some)\w+|all|they|it|things|the \w+|the swaps|any of \w+)"
_AT_FIRST = Phrases({
    "the container that stood there before anything moved":
        rf"\b(?:before|until) {_SUBJECT} (?:\w+ )?{_MOVED}\b",
    "the container that started there": r"\b(?:that|which) (?:had )?started(?: out)?\b",
    "the container that stood there before moving": rf"\bbefore (?:the )?(?:\w+ )?{_MOVED}\b",
    "the container that stood there at the start":
        r"\b(?:originally|initially|to begin with|at first|at the (?:start|beginning|outset)"
        r"|in the beginning)\b",
})  # fmt: skip
_AT_LAST = Phrases({
    "the container that is there after everything has moved":
        rf"\bafter {_SUBJECT} (?:\w+ )?{_MOVED}\b",
    "the container that is now there": r"\b(?:stands?|is|are) now\b",
    "the container that now stands there": r"\bnow (?:stands?|is|are)\b",
})  # fmt: skip


class TemporalRelation(NamedTuple):
    """A description of a moment.

    Attributes:
        kind: ``named`` names the moment; ``other`` names or points at the other moment;
            ``neighbor`` names or points at the neighboring placement; ``introduced`` points at the
            moment.
        moments: the named moments.
    """

    kind: Literal["named", "other", "neighbor", "introduced"]
    moments: tuple[PressRelation, ...] = ()


def named_moments(text: str) -> tuple[PressRelation, ...]:
    """Return the moments about the button press that a sentence names, in order."""
    if not _PRESS.search(text):
        return ()
    text = re.sub(_EITHER_SIDE, "", text)
    return tuple(_WORD[found[1]] for found in _NAMED.finditer(text))


def mentioned_times(text: str) -> frozenset[Time]:
    """Return whether a sentence is about places before things move, after that, or both."""
    times: set[Time] = set()
    if _AT_FIRST.search(text):
        times.add("at first")
    if _AT_LAST.search(text):
        times.add("at last")
    return frozenset(times)


def read_temporal_relation(text: str) -> TemporalRelation | None:
    """Return the description of a moment; None if there is none."""
    named = named_moments(text)
    if _NEIGHBOR.search(text):
        return TemporalRelation("neighbor", named)
    rejected = _NOT.search(text) if named else None
    if rejected:
        return TemporalRelation("other", (_WORD[rejected[1]],))
    if _OTHER.search(text):
        return TemporalRelation("other", named)
    if named:
        return TemporalRelation("named", named)
    return TemporalRelation("introduced") if _POINTER.search(text) else None


def neighbors(moments: Collection[PressRelation], past: tuple[Fact, ...]) -> set[PressRelation]:
    """Return the moments whose placements are neighbors of those of the given moments."""
    kinds = [fact.kind for fact in past]
    pressed = kinds.index("pressed") if "pressed" in kinds else 0
    earlier = kinds[:pressed].count("placed")
    # Placements count from 1: the last one before the press and the first one after it.
    numbers: dict[PressRelation, int] = {"before": earlier, "after": earlier + 1}
    near = {numbers[one] + step for one in moments for step in (-1, 1)}
    return {one for one, number in numbers.items() if number in near}
