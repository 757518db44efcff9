"""What the listener keeps in mind of the sentences before the command."""

from __future__ import annotations

import functools
import re
from collections.abc import Iterable
from typing import NamedTuple

from roboirg.language.interpreter.ordinals import named_positions
from roboirg.language.interpreter.places import Place, read_places
from roboirg.language.interpreter.quantities import plain_numbers, quantities
from roboirg.language.interpreter.temporal_relations import (
    PressRelation,
    Time,
    named_moments,
    time_told,
)
from roboirg.language.interpreter.tokens import COLOR, Sentence, colors_in

_DISMISSAL = re.compile(
    r"\b(never mind|nothing to do with|not matter|no matter|ignore|forget (about )?"
    r"(it|that|this|them)|irrelevant|not important|unimportant|regardless|not for you)\b"
)


class Remark(NamedTuple):
    """What one sentence names."""

    colors: tuple[str, ...]
    numbers: tuple[int, ...]
    amounts: tuple[tuple[str, int], ...]
    positions: tuple[int, ...]
    moments: tuple[PressRelation, ...]
    places: tuple[Place, ...]
    times: frozenset[Time]
    camera: bool
    dismissed: bool


class DiscourseContext(NamedTuple):
    """What has been introduced so far, in order, and what was said about it.

    Attributes:
        colors: introduced colors.
        singled: a color of those that was spoken of again, alone.
        numbers: introduced quantities.
        amounts: introduced quantities of cubes of a color.
        positions: introduced elements of a series, 1 for the first.
        moments: introduced moments of the video.
        chosen: a moment of those that was spoken of again, alone.
        places: introduced places.
        times: whether places were said to be those before or after things moved.
        mirrored: whether places were told as the camera sees them.
    """

    colors: tuple[str, ...] = ()
    singled: str | None = None
    numbers: tuple[int, ...] = ()
    amounts: tuple[tuple[str, int], ...] = ()
    positions: tuple[int, ...] = ()
    moments: tuple[PressRelation, ...] = ()
    chosen: PressRelation | None = None
    places: tuple[Place, ...] = ()
    times: frozenset[Time] = frozenset()
    mirrored: bool = False


@functools.lru_cache(maxsize=8192)
def read_remark(words: Sentence) -> Remark:
    """One sentence on its own."""
    text = " ".join(words)
    places = read_places(words)
    return Remark(
        # A cube that only tells a place is no referent of its own.
        colors=() if places else colors_in(words),
        numbers=() if places else plain_numbers(words),
        amounts=() if places else _amounts(text),
        positions=named_positions(text),
        moments=named_moments(text),
        places=places,
        times=time_told(text),
        camera="camera" in words,
        dismissed=_DISMISSAL.search(text) is not None,
    )


def _amounts(text: str) -> tuple[tuple[str, int], ...]:
    """``two of the red cubes and a blue one``."""
    found: list[tuple[str, int]] = []
    for one in quantities(text):
        after = re.match(rf"\s*(?:cubes? )?(?:of )?(?:the )?({COLOR})s?\b", text[one.end :])
        if one.plain and after and one.told.quantity is not None:
            found.append((after[1], one.told.quantity))
    return tuple(found)


def read_discourse(sentences: Iterable[Sentence]) -> DiscourseContext:
    """What is in mind after these sentences; what the speaker waves aside is not."""
    context = DiscourseContext()
    for sentence in sentences:
        remark = read_remark(sentence)
        if not remark.dismissed:
            context = _heard(context, remark)
    return context


def _heard(context: DiscourseContext, remark: Remark) -> DiscourseContext:
    fresh = [color for color in remark.colors if color not in context.colors]
    again = not fresh and len(remark.colors) == 1
    moments = (*context.moments, *remark.moments)
    introduced = tuple(dict.fromkeys(moments))
    return DiscourseContext(
        colors=tuple(dict.fromkeys((*context.colors, *fresh))),
        singled=remark.colors[0] if again else context.singled,
        numbers=tuple(dict.fromkeys((*context.numbers, *remark.numbers))),
        amounts=tuple(dict.fromkeys((*context.amounts, *remark.amounts))),
        positions=tuple(dict.fromkeys((*context.positions, *remark.positions))),
        moments=introduced,
        chosen=moments[-1] if len(moments) > len(introduced) > 1 else None,
        places=(*context.places, *remark.places),
        times=context.times | remark.times,
        mirrored=context.mirrored or (remark.camera and bool(remark.places)),
    )
