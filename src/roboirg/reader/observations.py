"""Observations: words for what is seen in the scene or the video, read as what they stand for.

*The cube in the middle* is read as *the red cube*, *once for every swap* as *two times*, *the last
placement* as *the third placement*. The other modules read the sentence that is left.
"""

from __future__ import annotations

import functools
from collections.abc import Callable, Iterator, Sequence
from typing import NamedTuple

from roboirg.core.episode import Goal, Scene
from roboirg.reader.observed_numbers import observed_amount, observed_times
from roboirg.reader.observed_placements import observed_placement
from roboirg.reader.observed_things import observed_thing, with_remaining
from roboirg.reader.phrases import Phrases, Span
from roboirg.reader.tokens import COLOR, Sentence

_LIKE = Phrases({"two cubes like the red cube": rf"\blike the ({COLOR}) cube\b"})
Find = Callable[[str, Scene], Iterator[Span]]


class Observed(NamedTuple):
    """Sentences without words for what is seen, and complaints about unclear ones."""

    sentences: tuple[Sentence, ...]
    complaints: tuple[str, ...]


def observe(sentences: tuple[Sentence, ...], scene: Scene, goals: Sequence[Goal]) -> Observed:
    """Replace the words for what is seen in a scene by names, numbers and ordinals.

    If goals have a relation to the press, placements are named by it, else by their number.
    """
    moments = bool(goals) and "relation" in goals[0].as_mapping()
    placed = functools.partial(observed_placement, moments=moments)
    finders: tuple[Find, ...] = (
        *(observed_thing, observed_times, observed_amount, placed),
        _likeness,
    )
    read: list[Sentence] = []
    complaints: list[str] = []
    for sentence in with_remaining([" ".join(words) for words in sentences]):
        text = sentence
        for find in finders:
            for start, end, meaning in sorted(find(text, scene), reverse=True):
                if meaning is None:
                    complaints.append(f'sees nothing or several things for "{text[start:end]}"')
                else:
                    text = f"{text[:start]}{meaning}{text[end:]}"
        read.append(tuple(text.split()))
    return Observed(tuple(read), tuple(dict.fromkeys(complaints)))


def _likeness(text: str, _scene: Scene) -> Iterator[Span]:
    """Yield *like the red cube*, which is no further cube, as *like the red ones*."""
    for found in _LIKE.finditer(text):
        yield (*found.span(), f"like the {found[1]} ones")
