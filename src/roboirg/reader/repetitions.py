"""Repetitions that add up: *do it again*, *once more*, *repeat it two more times*."""

from __future__ import annotations

import functools
import re
from collections.abc import Iterable, Iterator

from roboirg.reader.phrases import Phrases
from roboirg.reader.quantities import ADVERBS, times_mentions
from roboirg.reader.tokens import NUMBER, Sentence, number_of, word_set

_TRIGGERS = word_set("again more another same repeat second third each every")
_AND = r"(?<!\w)(?:(?:[,;:]|and|then|also) )*"
_DO = (
    rf"{_AND}(?:do|repeat|perform) "
    r"(?:(?:it|this|that|so|the same(?: thing)?|the (?:action|motion)) )?"
)
_MORE = Phrases({
    "and then repeat it two more times":
        rf"(?:{_DO}|{_AND}(?<=[,;:dn] ))(?P<more>{NUMBER}) (?:more|further) times?\b(?! than)",
    "and then do it twice more": rf"(?:{_DO}|{_AND})(?P<adverb>once|twice|thrice) more\b(?! than)",
    "and repeat it once": rf"{_AND}repeat (?:it |this |that )?(?P<once>once)\b",
    "do this a second time": rf"{_DO}a (?:second|third) time\b",
    "and then do the same again": rf"{_DO}(?:again|another time)\b",
    "on the target, and again":
        r"(?<!\w)(?:(?:[,;:]|and|then) )+(?:again|another time)(?= [,;]| and\b|$)",
    "do the same": rf"{_AND}(?:do|repeat) the same(?: thing)?(?= ?[,;]| and\b|$)",
    "Pick it up and then pick it up again":
        r"(?<=\w) (?:(?:[,;:]|and|then) )+(?P<pick>pick|lift|take|grab) (?:up )?"
        r"(?:it|the cube|that one)(?: up)? again\b",
})  # fmt: skip
"""What adds one to the repetitions before it, or a number."""
_SEEN = Phrases({
    "Pick it up again.": r"\b(?:pick|lift|take|grab)(?: [\w']+){0,16}?(?P<seen> again)\b",
    "Pick it up one more time.": rf"\b{NUMBER}(?P<before> more) times?\b(?! than)",
    "Pick it up two times more.": rf"\b{NUMBER} times?(?P<after> more)\b(?! than)",
})  # fmt: skip
"""Words that count from what the video shows."""
_DOWN = Phrases({
    "put it down again":
        r"\b(?:put|set|lay|lower|place)(?: \w+){0,3} (?:down|back|table)(?P<down> again)\b",
})  # fmt: skip
_UNREAD = Phrases({
    "Take it there again.": r"(?:\w+ )?\bagain\b",
    "Pick it up once for each of them.":
        r"\b(?:once|twice|times?) (?:for|per) (?:each|every)\b",
    "Do the same with the red cube.": r"\b(?:do|repeat) (?:exactly )?the same\b(?: \w+)?",
    "Put it there one more time.": rf"\b{NUMBER} (?:more times?|times? more)\b(?! than)",
})  # fmt: skip


@functools.lru_cache(maxsize=4096)
def added_up(words: Sentence, *, repeats: bool, seen: bool) -> tuple[Sentence, str]:
    """Return a command whose repetitions are one number, and words for more of them.

    Args:
        words: of the command.
        repeats: whether goals of the task have a number of repetitions; otherwise all are unread.
        seen: whether the video shows acts, so that to do something *again* may be to do it once.
    """
    if _TRIGGERS.isdisjoint(words):
        return words, ""
    text = " ".join(words)
    marks = list(_added(text))
    rest = _without(_without(text, marks), _DOWN.finditer(_without(text, marks)))
    rest = _without(rest, _SEEN.finditer(rest)) if seen else rest
    named = times_mentions(rest)
    numbers = {one.expression.quantity for one in named} or {1}
    unread = _UNREAD.search(rest) or (
        marks and (not repeats or len(numbers) > 1 or None in numbers) and marks[0]
    )
    if unread:
        return words, unread[0].strip(" ,")
    if not marks:
        return tuple(rest.split()), ""
    for one in reversed(named):
        rest = f"{rest[: one.start]}{rest[one.end :]}"
    total = sum(map(_more, marks), numbers.pop() or 0)
    return tuple(f"{rest} , {total} times".split()), ""


def more_mentions(text: str) -> Iterator[re.Match[str]]:
    """Yield the words for more repetitions, of which `added_up` names those that it cannot add."""
    yield from _added(text)
    yield from _SEEN.finditer(text)


def _added(text: str) -> Iterator[re.Match[str]]:
    for found in _MORE.finditer(text):
        # Without a pick before it, "pick it up again" is about the video.
        if not found["pick"] or re.search(rf"(?<!you )\b{found['pick']}\b", text[: found.start()]):
            yield found


def _more(mark: re.Match[str]) -> int:
    return number_of(mark["more"] or "") or ADVERBS[mark["adverb"] or mark["once"] or "once"]


def _without(text: str, found: Iterable[re.Match[str]]) -> str:
    """Return a text without what was found, or without its group."""
    for one in reversed(list(found)):
        start, end = one.span(one.lastgroup if one.lastgroup in _CUT else 0)
        text = f"{text[:start]} {text[end:]}"
    return " ".join(text.split())


_CUT = ("seen", "before", "after", "down")
