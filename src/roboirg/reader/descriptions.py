"""Descriptions: read the words for a thing or a color."""

from __future__ import annotations

from typing import Literal, NamedTuple

from roboirg.reader.phrases import Phrases
from roboirg.reader.places import NamedPlace, read_places
from roboirg.reader.temporal_relations import Time, mentioned_times
from roboirg.reader.tokens import (
    COLOR,
    THING,
    THINGS,
    Sentence,
    color_of,
    colors_in,
    ordinal_of,
    word_set,
)

_PRONOUNS = word_set("it them")
_POINTED = word_set("cube box tape one color container")
_PLACE_NOUNS = word_set("place spot position location")
_SERIES_NOUNS = word_set("visit placement time pass placing stay occasion")
_FORMER = {"former": 0, "latter": -1}
_MENTIONED = Phrases({
    "the one I mentioned earlier":
        r"\bthe (?:cubes?|box|container|tapes?|ones?) (?:that )?i (?:just )?"
        r"(?:mentioned|named|spoke of)\b",
})  # fmt: skip
CHOSEN = Phrases({
    "the cube I want":
        r"\b(?:the|my) (?P<noun>cubes?|box|container|tapes?|ones?|color|place|spot) i "
        r"(?:mean|meant|want|wanted|need|asked for|favor|chose|choose|prefer|preferred|decided on"
        r"|settled on|picked|selected|opted for|would like|have chosen|have picked)\b",
})  # fmt: skip
_OTHERS = Phrases({
    "the other one":
        r"\bthe (?:other (?P<noun>cubes?|ones?|box|container|tape|place|spot)|others"
        r"|other(?=$| color$)|one (?:that is left|left over))(?!\w)"
        r"(?! (?:of|from|than)\b| in (?:those|these|them|the two)\b)",
})  # fmt: skip

DescriptionKind = Literal[
    "any",
    "color",
    "not",
    "other",
    "place",
    "introduced",
    "introduced place",
    "remaining",
]


class Description(NamedTuple):
    """A description of one thing to handle.

    Attributes:
        kind: ``any`` describes nothing; ``color`` names a color; ``not`` excludes colors; ``other``
            is the remaining one of some colors; ``place`` names a place; ``introduced`` and
            ``introduced place`` point at an earlier color or place; ``remaining`` is the other one
            of two introduced ones.
        colors: named colors; empty if the words point at those of the context.
        excluded: for ``other``, the excluded color; None if the words only point at it.
        place: the named place.
        times: whether the place is the one before or after things move.
        position: index of the introduced value; None for any of them.
    """

    kind: DescriptionKind
    colors: tuple[str, ...] = ()
    excluded: str | None = None
    place: NamedPlace | None = None
    times: frozenset[Time] = frozenset()
    position: int | None = None


_THAN = Phrases(
    {
        "a color other than red": "other than",
        "a color different from red": "different from|different to|differs from|unlike",
        "a cube that is not in those colors": "not (?:in|of|among|one of|part of)",
        "the cube that is neither red nor blue": "neither",
        "any color except red": r"(?:(?<=color )|(?<=cube )|(?<=one )|(?<=box )"
        r"|(?<=tape ))(?:except|apart from|outside)"
        rf"(?= (?:for )?(?:the|those|that|these|this|{COLOR})\b)",
        "a cube of another color":
            "(?:another|(?:a|an|some|any) (?:different|other|new|distinct|alternative|separate))"
            " color",
        "a different one": r"(?:(?:a|any|some|the) (?:different|distinct|alternative)"
            rf"|(?:any|some) other)(?= (?:{THING}|one)\b)|another(?: and)?$",
    },
    before=r"\b",
    after=r"\b",
)  # fmt: skip
_COMPLEMENT = Phrases({
    "the cube in the other color": r"\bin the other color\b(?! (?:of|in|from)\b)",
    "the other color of those two":
        rf"\bthe other (?:one |color |(?:{THING}|{THINGS}) )?(?:of|in|from)\b"
        r"(?! (?:the |those |these )?(?:two )?(?:moments|visits|placements))",
    "the one of these two that is not red":
        r"\bthe (?:one|color) (?:of|in|from)\b.*\b(?:not|other than|except)\b",
})  # fmt: skip
_NOT = Phrases({
    "the one of these two that is not red":
        rf"\b(?:not|other than|except) (?:in |for |the )?({COLOR})\b",
})  # fmt: skip


def describe(words: Sentence) -> Description:
    """Return the description that the words for one thing give."""
    text = " ".join(words)
    colors = colors_in(words)
    places = read_places(words)
    if places:
        return Description("place", place=places[0], times=mentioned_times(text))
    if _COMPLEMENT.search(text):
        return _complement(text, colors)
    if _THAN.search(text):
        return Description("not", colors)
    if colors:
        return Description("color", tuple(dict.fromkeys(colors)))
    return _choice(text) or _pointer(words) or Description("any")


def _complement(text: str, colors: tuple[str, ...]) -> Description:
    found = _NOT.search(text)
    excluded = color_of(found[1]) if found else None
    among = tuple(dict.fromkeys(colors))
    return Description("other", () if among == (excluded,) else among, excluded)


def _choice(text: str) -> Description | None:
    """Read ``the cube I want`` and ``the other one``: the chosen value comes first."""
    if _MENTIONED.search(text):
        return Description("introduced", times=mentioned_times(text))
    for phrases, position in ((CHOSEN, 0), (_OTHERS, 1)):
        found = phrases.search(text)
        if found:
            plain: DescriptionKind = "remaining" if position else "introduced"
            kind = "introduced place" if found["noun"] in _PLACE_NOUNS else plain
            return Description(kind, times=mentioned_times(text), position=position)
    return None


def _pointer(words: Sentence) -> Description | None:
    times = mentioned_times(" ".join(words))
    if "there" in words:
        return Description("introduced place", times=times)
    for before, word, after in zip(("", *words), words, (*words[1:], ""), strict=False):
        position = _position(before, word)
        if position is not None and after not in _SERIES_NOUNS:
            kind: DescriptionKind = "introduced place" if after in _PLACE_NOUNS else "introduced"
            return Description(kind, times=times, position=position)
        if word in _PRONOUNS or (before in ("that", "this") and word in _POINTED):
            return Description("introduced")
    return None


def _position(before: str, word: str) -> int | None:
    """Return the index of ``the former`` or ``the second``; a bare ``first`` is an adverb."""
    if word in _FORMER:
        return _FORMER[word]
    rank = ordinal_of(word)
    return None if rank is None or before != "the" else rank - 1
