"""Pick order: *A after B*, *before lifting A, lift B*, *A first*, as the picks in their order."""

from __future__ import annotations

import functools
import re
from typing import NamedTuple

from roboirg.reader.phrases import Phrases, Rewrites
from roboirg.reader.tokens import COLOR, Sentence

_ACT = (
    r"(?:you )?(?:have |had )?(?:lift(?:ed|ing)?|uncover(?:ed|ing)?|reveal(?:ed|ing)?"
    r"|remov(?:ed?|ing)|rais(?:ed?|ing)|(?:pick(?:ed|ing)?|tak(?:en?|ing)) ?(?:up)?)"
)
_THING = rf"(?:the |that )?(?:container|box|one|{COLOR})"
_CLAUSE = Phrases({
    "before lifting the one over the red cube": rf"\b(?P<way>before|after) (?:{_ACT} )?(?={_THING})",
})  # fmt: skip
"""What comes before, or after, another pick."""
_EARLY = Phrases({"the red one first": r"(?<!^)(?<!\bthe )(?<!\bat )\bfirst\b(?! of\b)"})
_LATE = Phrases({
    "the red one second": r"(?<!\bthe )\b(?:second|last)\b(?! (?:of|from|to|closest|nearest|farthest|furthest)\b)",
})  # fmt: skip
_NAME = Phrases({"the red cube": rf"\b{COLOR}s?\b(?:'s)?(?: cube| one| container)*(?: is| goes)?"})
_WORDS = frozenset({"before", "after", "first", "second", "last"})
_ONE_EACH = Rewrites(
    r"same:: \bdo (?:exactly )?the same (?:with|for|to|on) (?:the (?:container|one) over )?(?:the )?"
    r"(COLOR)\b(?: cube| one)?(?!s)=>lift the container over the \1 cube",
    r"first:: \b((?:press|push|hit) (?:the |both |two )*buttons?) first\b=>\1",
    r"then finally also:: \b(it (?:(?:back|down|aside) )*(?:[,;] )?(?:and )?(?:then|also|finally) )"
    r"(?=the (?:one|container)\b)=>\1lift",
    parts={"COLOR": COLOR},
)
"""Picks without a verb of their own."""


class PickOrder(NamedTuple):
    """The words of a command with its picks in order, and the words that leave the order open."""

    words: Sentence
    unread: str = ""


@functools.lru_cache(maxsize=4096)
def in_order(words: Sentence) -> PickOrder:
    """Return a command for one or two picks with the one first that comes first.

    Words for an order that it cannot place are the unread ones.
    """
    words = tuple(_ONE_EACH.apply(" ".join(words), words).split())
    if _WORDS.isdisjoint(words):
        return PickOrder(words)
    text = " ".join(words)
    marks = [*_CLAUSE.finditer(text), *_EARLY.finditer(text), *_LATE.finditer(text)]
    if not marks:
        return PickOrder(words)
    unread = " ".join(text[marks[0].start() :].split()[:4])
    names = list(_NAME.finditer(text))
    colors = [re.match(COLOR, name[0]) for name in names]
    first, second = (colors + [None, None])[:2]
    if len(names) == 1 and not any("way" in mark.groupdict() for mark in marks):
        return PickOrder(_without(text, marks))
    if len(names) != 2 or first is None or second is None or first[0] == second[0]:  # noqa: PLR2004
        return PickOrder(words, unread)
    earlier = {_earlier(mark, names[0].span(), names[1].span()) for mark in marks}
    if len(earlier) != 1:
        return PickOrder(words, unread)
    if earlier == {1}:
        (start, end), (begin, stop) = (
            (name.start(), name.start() + len(color[0]))
            for name, color in zip(names, (first, second), strict=True)
        )
        text = text[:start] + second[0] + text[end:begin] + first[0] + text[stop:]
        marks = [*_CLAUSE.finditer(text), *_EARLY.finditer(text), *_LATE.finditer(text)]
    return PickOrder(_without(text, marks))


def _earlier(mark: re.Match[str], first: tuple[int, int], second: tuple[int, int]) -> int:
    """Return which of two names, 0 or 1, a mark makes the earlier one."""
    place = 0 if mark.end() <= first[0] else 1 if mark.end() <= second[0] else 2
    way = mark.groupdict().get("way")
    if way is not None:
        # "after A, B" and "A after B" put A and B first, with "before" it is the other way round.
        return min(place, 1) if way == "after" else 1 - min(place, 1)
    named = 0 if place == 0 or (place == 1 and mark.start() == first[1] + 1) else 1
    return named if mark[0] == "first" else 1 - named


def _without(text: str, marks: list[re.Match[str]]) -> Sentence:
    """Return a text whose clauses stand side by side, and without other words for an order."""
    for mark in sorted(marks, key=lambda one: one.start(), reverse=True):
        joint = ""
        if "way" in mark.groupdict():
            joint = ", lift " if len(mark[0].split()) > 1 else ", then the container over "
        text = text[: mark.start()] + joint + text[mark.end() :]
    return tuple(text.split())
