"""Discourse context: what the sentences before the command introduce."""

from __future__ import annotations

import functools
from collections.abc import Iterable
from typing import NamedTuple, TypeVar

from roboirg.reader.ordinals import named_positions
from roboirg.reader.phrases import Phrases
from roboirg.reader.places import NamedPlace, read_places
from roboirg.reader.quantities import plain_numbers, quantities
from roboirg.reader.temporal_relations import PressRelation, Time, mentioned_times, named_moments
from roboirg.reader.tokens import COLOR, Sentence, colors_in

Value = TypeVar("Value")

_DISMISSAL = Phrases(
    {
        "Never mind that.": "never mind|ignore|regardless",
        "That has nothing to do with you.": "nothing to do with",
        "Not that it matters.": "not that it matters|not matter|no matter",
        "Forget about that.": "forget (?:about )?(?:it|that|this|them)",
        "That is not important.": "not important|unimportant|irrelevant",
        "That is not for you.": "not for you",
    },
    before=r"\b",
    after=r"\b",
)
_OF_COLOR = Phrases({"of the red cubes": rf"\s*(?:cubes? )?(?:of )?(?:the )?({COLOR})s?\b"})
"""What follows a number of cubes."""


class Remark(NamedTuple):
    """The values that one sentence names."""

    colors: tuple[str, ...]
    numbers: tuple[int, ...]
    amounts: tuple[tuple[str, int], ...]
    positions: tuple[int, ...]
    moments: tuple[PressRelation, ...]
    places: tuple[NamedPlace, ...]
    times: frozenset[Time]
    camera: bool
    dismissed: bool


class DiscourseContext(NamedTuple):
    """The values that sentences introduce, in order.

    Attributes:
        colors: introduced colors.
        preferred_color: an introduced color that a later sentence names again, alone.
        numbers: introduced numbers.
        preferred_number: an introduced number that a later sentence names again, alone.
        amounts: introduced numbers of cubes, with their color.
        positions: introduced elements of a series, 1 for the first.
        preferred_position: an introduced element that a later sentence names again, alone.
        moments: introduced moments of the video.
        preferred_moment: of several introduced moments the one named twice, even in one
            sentence: *before and after, the one before*; None after a further sentence.
        places: introduced places.
        times: whether the places are those before or after things move.
        mirrored: whether left and right are those of the front camera's picture.
        selected: whether a remark singles one of two values out.
    """

    colors: tuple[str, ...] = ()
    preferred_color: str | None = None
    numbers: tuple[int, ...] = ()
    preferred_number: int | None = None
    amounts: tuple[tuple[str, int], ...] = ()
    positions: tuple[int, ...] = ()
    preferred_position: int | None = None
    moments: tuple[PressRelation, ...] = ()
    preferred_moment: PressRelation | None = None
    places: tuple[NamedPlace, ...] = ()
    times: frozenset[Time] = frozenset()
    mirrored: bool = False
    selected: bool = False

    def introduces_pair(self) -> bool:
        """Return whether two values of one kind are introduced."""
        pairs = (self.colors, self.places, self.numbers, self.positions, self.moments)
        return any(len(pair) == 2 for pair in pairs)  # noqa: PLR2004


def names_camera(words: Sentence) -> bool:
    """Return whether left and right may be those of the front camera's picture."""
    return "camera" in words or "camera's" in words


@functools.lru_cache(maxsize=8192)
def read_remark(words: Sentence) -> Remark:
    """Read one sentence on its own."""
    text = " ".join(words)
    places = read_places(words)
    return Remark(
        # A cube in the words for a place is no referent.
        colors=() if places else colors_in(words),
        numbers=() if places else plain_numbers(words),
        amounts=() if places else _amounts(text),
        positions=named_positions(text),
        moments=named_moments(text),
        places=places,
        times=mentioned_times(text),
        camera=names_camera(words),
        dismissed=_DISMISSAL.search(text) is not None,
    )


def _amounts(text: str) -> tuple[tuple[str, int], ...]:
    """Return the colors and numbers of ``two of the red cubes and a blue one``."""
    found: list[tuple[str, int]] = []
    for one in quantities(text):
        after = _OF_COLOR.match(text, one.end)
        if one.plain and after and one.expression.quantity is not None:
            found.append((after[1], one.expression.quantity))
    return tuple(found)


def read_discourse(sentences: Iterable[Sentence]) -> DiscourseContext:
    """Return what these sentences introduce, without those that the speaker dismisses."""
    context = DiscourseContext()
    for sentence in sentences:
        remark = read_remark(sentence)
        if not remark.dismissed:
            context = _with_remark(context, remark)
    return context


def _again(introduced: tuple[Value, ...], named: tuple[Value, ...]) -> Value | None:
    """Return the value that a sentence names alone, if it was introduced before.

    It may have been in the same sentence: *Green and red are taken, red by Leo.*
    """
    if len(named) == 1 and named[0] in introduced:
        return named[0]
    twice = {one for one in named if named.count(one) > 1}
    return twice.pop() if len(twice) == 1 and len(set(named)) > 1 else None


def _with_remark(context: DiscourseContext, remark: Remark) -> DiscourseContext:
    moments = (*context.moments, *remark.moments)
    introduced = tuple(dict.fromkeys(moments))
    return DiscourseContext(
        colors=tuple(dict.fromkeys((*context.colors, *remark.colors))),
        preferred_color=_again(context.colors, remark.colors) or context.preferred_color,
        numbers=tuple(dict.fromkeys((*context.numbers, *remark.numbers))),
        preferred_number=_again(context.numbers, remark.numbers) or context.preferred_number,
        amounts=tuple(dict.fromkeys((*context.amounts, *remark.amounts))),
        positions=tuple(dict.fromkeys((*context.positions, *remark.positions))),
        preferred_position=_again(context.positions, remark.positions)
        or context.preferred_position,
        moments=introduced,
        preferred_moment=moments[-1] if len(moments) > len(introduced) > 1 else None,
        places=(*context.places, *remark.places),
        times=context.times | remark.times,
        mirrored=context.mirrored or (remark.camera and bool(remark.places)),
    )
