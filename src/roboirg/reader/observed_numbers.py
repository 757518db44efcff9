"""Numbers to be counted: *once for every swap*, *all but three*, *as many as there are ...*."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from roboirg.core.episode import Scene, SceneObject
from roboirg.core.motions import Swap
from roboirg.reader.object_positions import scene_at_last
from roboirg.reader.phrases import Phrases, Span
from roboirg.reader.places import TIE
from roboirg.reader.tokens import COLOR, NUMBER, number_of

_SIDE = "(?P<side>farther to your (?:left|right)|closer to you|farther from you)"
_COUNT = "(?:(?:first |now )?(?:count|note|think|look|see) )?"
_SWAPS = Phrases({
    "once for every time that cubes changed places":
        r"once for every time that cubes changed places\b",
    "as many times as there were swaps in the video":
        r"as many times as there were swaps in the video\b",
    "count how often cubes changed places in the video":
        rf"{_COUNT}how often cubes changed places in the video\b",
    "note how many swaps there were in the video":
        rf"{_COUNT}how many swaps there were in the video\b",
})  # fmt: skip
_BESIDE = Phrases({
    "once for every red cube now closer to you than the cube in the video":
        "(?:(?P<itself>once for the cube in the video and )?once for every"
        "|as many times as there are) "
        rf"(?:(?P<color>{COLOR}) )?cubes? now {_SIDE} "
        r"than (?:the cube in the video|the lifted one|it is)\b"
        r"(?P<more>(?: ,)? and once more\b)?",
    "count the red cubes that are now closer to you than the cube from the video , and add one":
        rf"{_COUNT}(?:the|how many) (?:(?P<shade>{COLOR}) )?cubes (?:that )?are now "
        rf"{_SIDE.replace('side', 'way')} than (?:the cube from the video|the lifted one)\b"
        r"(?P<plus>(?: ,)? (?:and add|plus) one\b)?",
})  # fmt: skip
_ALL_BUT = Phrases({
    "all but three of the red cubes":
        rf"all but (?P<left>{NUMBER}) of the (?P<color>{COLOR}) cubes\b",
    "all of the red cubes except for three":
        rf"all of the (?P<shade>{COLOR}) cubes except (?:for )?(?P<kept>{NUMBER})\b",
})  # fmt: skip
_AMOUNT = Phrases({
    "as many of the red cubes as there are closer to you than the bin":
        rf"(?:as many of the (?P<color>{COLOR}) cubes as there are"
        rf"|the same number of the (?P<shade>{COLOR}) cubes as you see) "
        rf"{_SIDE} than the (?P<fixture>bin|button)\b",
})  # fmt: skip


def observed_times(text: str, scene: Scene) -> Iterator[Span]:
    """Yield the words for a number of repetitions, each with the number that is seen."""
    swaps = len(scene.motions_of(Swap))
    for found in _SWAPS.finditer(text):
        yield (*found.span(), _number(swaps, "times"))
    shown = {fact.subject for fact in scene.past}
    for found in _BESIDE.finditer(text) if shown else ():
        last = scene_at_last(scene)
        (reference,) = (last[name] for name in shown)
        cubes = [
            item
            for item in last.of_kind("cube")
            if item != reference and (found["color"] or found["shade"]) in (None, item.color)
        ]
        count = _count(cubes, reference, found["side"] or found["way"])
        if count is not None and (found["itself"] or found["more"] or found["plus"]):
            count += 1
        yield (*found.span(), _number(count, "times"))


def observed_amount(text: str, scene: Scene) -> Iterator[Span]:
    """Yield the words for a number of cubes of a color, each with the number that is seen."""
    for found in _ALL_BUT.finditer(text):
        color, left = found["color"] or found["shade"], found["left"] or found["kept"]
        count = len(_of_color(scene, color)) - (number_of(left) or 0)
        yield (*found.span(), _number(count, f"of the {color} cubes"))
    for found in _AMOUNT.finditer(text):
        color = found["color"] or found["shade"]
        (reference,) = scene.of_kind(found["fixture"])
        counted = _count(_of_color(scene, color), reference, found["side"])
        yield (*found.span(), _number(counted, f"of the {color} cubes"))


def _of_color(scene: Scene, color: str) -> list[SceneObject]:
    return [item for item in scene.of_kind("cube") if item.color == color]


def _number(count: int | None, noun: str) -> str | None:
    """Return a number in words that follow it; None unless something is counted."""
    if not count or count < 0:
        return None
    return "once" if (count, noun) == (1, "times") else f"{count} {noun}"


def _count(things: Sequence[SceneObject], reference: SceneObject, side: str) -> int | None:
    """Return how many things lie beyond another one, in a direction; None for near ties."""
    axis = 0 if side.endswith("you") else 1
    sign = -1 if side == "closer to you" or side.endswith("right") else 1
    away = [sign * (item.position[axis] - reference.position[axis]) for item in things]
    if any(abs(one) <= TIE for one in away):
        return None
    return sum(one > 0 for one in away)
