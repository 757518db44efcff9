"""What the listener keeps in mind of the sentences before the command."""

from __future__ import annotations

import functools
import re
from collections.abc import Iterable
from typing import NamedTuple

from roboirg.episode import COLOURS
from roboirg.language.resolver.places import Place, read_places
from roboirg.language.resolver.tokens import Sentence, number_of, word_set

_DISMISSAL = re.compile(
    r"\b(never mind|nothing to do with|not matter|doesn't matter|no matter|ignore|forget (about )?"
    r"(it|that|this|them)|irrelevant|not important|unimportant|regardless|not for you)\b"
)
_POINTERS = word_set("the that this those these which other another every each any some no")
"""Before a number word they make it a pointer: ``the two``, ``that one``."""


class Remark(NamedTuple):
    """What one sentence names."""

    colours: tuple[str, ...]
    numbers: tuple[int, ...]
    places: tuple[Place, ...]
    camera: bool
    dismissed: bool


class Context(NamedTuple):
    """What has been introduced so far, in order, and what was said about it.

    Attributes:
        colours: introduced colours.
        singled: a colour of those that was spoken of again, alone.
        numbers: introduced quantities.
        places: introduced places.
        mirrored: whether places were told as the camera sees them.
    """

    colours: tuple[str, ...] = ()
    singled: str | None = None
    numbers: tuple[int, ...] = ()
    places: tuple[Place, ...] = ()
    mirrored: bool = False


@functools.lru_cache(maxsize=8192)
def read_remark(words: Sentence) -> Remark:
    """One sentence on its own."""
    numbers: list[int] = []
    for before, word in zip(("", *words), words, strict=False):
        number = number_of(word)
        if number is not None and before not in _POINTERS:
            numbers.append(number)
    places = read_places(words)
    return Remark(
        # A cube that only tells a place is no referent of its own.
        colours=() if places else tuple(word for word in words if word in COLOURS),
        numbers=() if places else tuple(numbers),
        places=places,
        camera="camera" in words,
        dismissed=_DISMISSAL.search(" ".join(words)) is not None,
    )


def listen(sentences: Iterable[Sentence]) -> Context:
    """What is in mind after these sentences; what the speaker waves aside is not."""
    colours: list[str] = []
    singled: str | None = None
    numbers: tuple[int, ...] = ()
    places: list[Place] = []
    mirrored = False
    for sentence in sentences:
        remark = read_remark(sentence)
        if remark.dismissed:
            continue
        fresh = [colour for colour in remark.colours if colour not in colours]
        if not fresh and len(remark.colours) == 1:
            singled = remark.colours[0]
        colours += dict.fromkeys(fresh)
        numbers += remark.numbers
        places += remark.places
        mirrored = mirrored or (remark.camera and bool(remark.places))
    return Context(tuple(colours), singled, tuple(dict.fromkeys(numbers)), tuple(places), mirrored)
