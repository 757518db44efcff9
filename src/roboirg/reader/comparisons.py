"""Comparisons: the one of two things that stands nearer, farther away, or farther to one side."""

from __future__ import annotations

import itertools
from collections.abc import Collection, Iterator
from typing import NamedTuple

from roboirg.core.episode import Scene, SceneObject
from roboirg.reader.phrases import Phrases
from roboirg.reader.places import TIE

_COMPARATIVE = Phrases({
    "the cube of another color that is nearer to you": r"\b(?P<near>nearer|closer)(?: to you)?\b",
    "the one that is farther to the left":
        r"\b(?:farther|further) (?:over )?(?:to|on) (?:the|your) (?P<side>left|right)\b",
    "the one that is farther away from you":
        r"\b(?P<far>farther|further)(?: away)?(?: from you)?\b(?! (?:over|to|on)\b)",
})  # fmt: skip


class PlaceComparison(NamedTuple):
    """An order of two things.

    Attributes:
        axis: 0 to compare how far they are from the robot, 1 to compare how far on its left.
        sign: +1 if the larger coordinate is meant, -1 for the smaller.
    """

    axis: int
    sign: int


def read_comparison(text: str) -> PlaceComparison | None:
    """Return the comparison in the words for one thing; None if there is none."""
    found = _COMPARATIVE.search(text)
    if found is None:
        return None
    if found["side"]:
        return PlaceComparison(1, 1 if found["side"] == "left" else -1)
    return PlaceComparison(0, -1 if found["near"] else 1)


def compared_colors(
    comparison: PlaceComparison, scene: Scene, excluded: Collection[str]
) -> set[str]:
    """Return the colors that a comparison of the two things of other colors can mean.

    If no color is excluded, any one may be. Things are compared where they stand at first.
    """
    colored = [item for item in scene.objects if item.color is not None]
    colors = sorted({str(item.color) for item in colored})
    found: set[str] = set()
    for left in _remaining(colors, excluded):
        pair = [item for item in colored if item.color in left]
        found |= {str(item.color) for item in _foremost(comparison, pair)}
    return found


def _remaining(colors: list[str], excluded: Collection[str]) -> Iterator[set[str]]:
    """Yield the colors that are left; for every choice of one excluded color if none is known."""
    if excluded:
        yield set(colors) - set(excluded)
        return
    yield from map(set, itertools.combinations(colors, len(colors) - 1))


def _foremost(comparison: PlaceComparison, items: list[SceneObject]) -> list[SceneObject]:
    if not items:
        return []
    places = [comparison.sign * item.position[comparison.axis] for item in items]
    return [item for item, place in zip(items, places, strict=True) if max(places) - place <= TIE]
