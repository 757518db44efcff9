"""Placements of the video: counted from its end, by the press, by the target's place and moves."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence

from roboirg.core.episode import Scene, SceneObject
from roboirg.core.motions import Swap
from roboirg.reader.phrases import Phrases, Span
from roboirg.reader.places import TIE
from roboirg.reader.tokens import ORDINAL, ordinal_of

_FROM_THE_END = Phrases({
    "the last placement but one":
        rf"the (?:(?P<rank>{ORDINAL}|next) to )?(?:last|final) placement(?P<but> but one)?\b",
})  # fmt: skip
_BEFORE_PRESS = Phrases({
    "the placement right before the button press":
        r"the placement (?:right before the button press|that the button press followed)\b",
})  # fmt: skip
_AT = Phrases({
    "the placement that was made closest to you":
        "the placement (?:(?:that was )?made )?"
        "(?P<place>farthest (?:to your (?:left|right)|from you)"
        r"|closest to (?:you|the button))\b",
})  # fmt: skip
_MOVED = Phrases({
    "the placement whose target later changed places":
        "the placement whose target (?:(?P<moved>moved in the end|later changed places)"
        r"|never moved|stayed where it was)\b",
})  # fmt: skip
_ORDINALS = ("first", "second", "third", "fourth", "fifth")


def observed_placement(text: str, scene: Scene, *, moments: bool) -> Iterator[Span]:
    """Yield the words for one placement, each with its number, or its moment about the press."""
    targets = {item.name: item for item in scene.of_kind("target")}
    placed = [str(fact.place) for fact in scene.past if fact.kind == "placed"]
    shown = [targets[name] for name in placed if name in targets]
    if not shown:
        return
    pressed = [fact.kind for fact in scene.past].index("pressed")
    names = [f"the {one} placement" for one in _ORDINALS]
    if moments:
        names = [
            f"the placement right {'before' if at < pressed else 'after'} the button press"
            for at in range(len(shown))
        ]
    for start, end, found in _placements(text, scene, shown, pressed):
        yield start, end, names[found[0]] if len(found) == 1 and found[0] >= 0 else None


def _placements(
    text: str, scene: Scene, shown: Sequence[SceneObject], pressed: int
) -> Iterator[tuple[int, int, list[int]]]:
    """Yield the words for placements, with the positions in the series of those that they fit."""
    for found in _FROM_THE_END.finditer(text):
        rank = 2 if found["but"] else ordinal_of(found["rank"] or "first") or 2
        yield (*found.span(), [len(shown) - rank])
    for found in _BEFORE_PRESS.finditer(text):
        yield (*found.span(), [pressed - 1])
    for found in _AT.finditer(text):
        away = [_along(found["place"], item, scene) for item in shown]
        yield (*found.span(), [at for at, one in enumerate(away) if one >= max(away) - TIE])
    moved = {name for swap in scene.motions_of(Swap) for name in (swap.first, swap.second)}
    for found in _MOVED.finditer(text) if moved else ():
        wanted = found["moved"] is not None
        yield (*found.span(), [at for at, one in enumerate(shown) if (one.name in moved) is wanted])


def _along(place: str, item: SceneObject, scene: Scene) -> float:
    """Return how far a target lies in a direction."""
    if place.endswith("button"):
        (button,) = scene.of_kind("button")
        return -math.dist(item.position[:2], button.position[:2])
    along = item.position.x if place.endswith("you") else item.position.y
    return -along if place == "closest to you" or place.endswith("right") else along
