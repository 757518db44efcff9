"""Repetitions that add up: *do it again*, *once more*, *repeat it two more times*."""

from __future__ import annotations

import functools
import re
from collections.abc import Iterator
from typing import NamedTuple

from roboirg.reader.phrases import Phrases
from roboirg.reader.quantities import ADVERBS, times_mentions
from roboirg.reader.tokens import NUMBER, Sentence, number_of, ordinal_of, word_set

_TRIGGERS = word_set("again more another same repeat second third each every")
_JOINT = r"(?:(?:[,;:]|and|then|also) )*"
_DO = (
    rf"{_JOINT}(?:do|repeat|perform) "
    r"(?:(?:it|this|that|so|the same(?: thing)?|the (?:action|motion)) )?"
)
_PICK = r"(?:pick|lift|take|grab)"
_MORE = Phrases({
    "and then repeat it two more times":
        rf"(?<!\w)(?:{_DO}|(?:(?:[,;:]|and|then) )+)(?P<more>{NUMBER}) (?:more|further) times?\b(?! than)",
    "and then do it twice more": rf"(?<!\w)(?:{_DO}|{_JOINT})(?P<adverb>once|twice|thrice) more\b(?! than)",
    "and repeat it once": rf"(?<!\w){_JOINT}repeat (?:it |this |that )?(?P<once>once)\b",
    "do this a third time": rf"(?<!\w){_DO}a (?P<rank>second|third) time\b",
    "and then do the same again": rf"(?<!\w){_DO}(?:again|another time)\b",
    "on the target, and again":
        r"(?<!\w)(?:(?:[,;:]|and|then) )+(?:again|another time)(?= [,;]| and\b|$)",
    "do the same": rf"(?<!\w){_JOINT}(?:do|repeat) the same(?: thing)?(?= ?[,;]| and\b|$)",
    "Pick it up and then pick it up again":
        rf"(?<=\w) (?:(?:[,;:]|and|then) )+(?P<pick>{_PICK}) (?:up )?(?:it|the cube|that one)(?: up)? again\b",
})  # fmt: skip
"""What adds to the repetitions before it: a number, up to a rank, else one."""
_PICKS = Phrases({"pick it up": rf"(?<!you )\b{_PICK}\b"})
_UNREAD = Phrases({
    "Take it there again.": r"(?:\w+ )?\bagain\b",
    "Pick it up once for each of them.": r"\b(?:once|twice|time|times) (?:for|per) (?:each|every)\b",
    "Do the same with the red cube.": r"\b(?:do|repeat) (?:exactly )?the same\b(?: \w+)?",
})  # fmt: skip
_LIKE_BEFORE = Phrases({
    "put it down again":
        r"\b(?:put|set|lay|lower|place)(?: \w+){0,3} (?:down|back|table)(?P<down> again)\b",
})  # fmt: skip
_BARE_MORE = Phrases({
    "Pick it up one more time.": rf"\b{NUMBER}(?P<before> more) times?\b(?! than)",
    "Pick it up two times more.": rf"\b{NUMBER} times?(?P<after> more)\b(?! than)",
})  # fmt: skip
"""Numbers that count from what the video shows."""
_LIKE_SEEN = Phrases({
    "Pick it up again.": rf"\b{_PICK}(?: [\w']+){{0,9}}?(?P<seen> again)\b",
})  # fmt: skip


class Repetitions(NamedTuple):
    """The words of a command with one number of repetitions, and the words that stay unread."""

    words: Sentence
    unread: str = ""


@functools.lru_cache(maxsize=4096)
def added_up(words: Sentence, *, repeats: bool, seen: bool) -> Repetitions:
    """Return a command whose repetitions are one number.

    Args:
        words: of the command.
        repeats: whether goals of the task have a number of repetitions; otherwise all words for
            one more are unread.
        seen: whether the video shows acts, so that to pick something up *again* may be to do it
            after that.
    """
    if _TRIGGERS.isdisjoint(words):
        return Repetitions(words)
    text = " ".join(words)
    marks = list(added(text))
    if marks and not repeats:
        return Repetitions(words, marks[0][0].strip(" ,"))
    rest = _without(text, [mark.span() for mark in marks])
    rest = _without(rest, [found.span("down") for found in _LIKE_BEFORE.finditer(rest)])
    if seen:
        for seen_before in (_LIKE_SEEN, _BARE_MORE):
            spans = [found.span(found.lastgroup or 0) for found in seen_before.finditer(rest)]
            rest = _without(rest, spans)
    unread = _UNREAD.search(rest) or _BARE_MORE.search(rest)
    if unread is not None:
        return Repetitions(words, unread[0])
    if not marks:
        return Repetitions(tuple(rest.split()))
    named = times_mentions(rest)
    numbers = {one.expression.quantity for one in named} or {1}
    base = numbers.pop()
    if base is None or numbers:
        return Repetitions(words, marks[0][0].strip(" ,"))
    rest = _without(rest, [(one.start, one.end) for one in named])
    total = functools.reduce(_added, marks, base)
    return Repetitions(tuple(f"{rest} , {total} times".split()))


def added(text: str) -> Iterator[re.Match[str]]:
    """Yield the words of a command that add repetitions."""
    for found in _MORE.finditer(text):
        # Without a pick before it, "pick it up again" is about the video.
        if found["pick"] is None or _PICKS.search(text[: found.start()]):
            yield found


def more_mentions(text: str) -> Iterator[re.Match[str]]:
    """Yield the words for more repetitions, of which `added_up` names those that it cannot add."""
    yield from added(text)
    yield from _BARE_MORE.finditer(text)


def _without(text: str, spans: list[tuple[int, int]]) -> str:
    for start, end in reversed(spans):
        text = f"{text[:start]} {text[end:]}"
    return " ".join(text.split())


def _added(total: int, mark: re.Match[str]) -> int:
    """Return the number of repetitions after one more phrase."""
    if mark["rank"]:
        return max(total, ordinal_of(mark["rank"]) or 0)
    more = mark["adverb"] or mark["once"] or "once"
    return total + (number_of(mark["more"] or "") or ADVERBS[more])
