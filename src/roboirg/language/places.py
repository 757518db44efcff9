"""Places as people say them: language 4's words for where a thing stands.

A place has two wordings. *All the way on the right* follows a noun and singles out one of several
things; *on the far right* says where something is or happens, and needs a truth of its own: the
thing stands clearly there, and no other one does. Left and right are those of a frame, as in
`landmarks`, and its margins hold: if one thing moves by less, no phrase goes over to another thing
(by half of it, if others are named as near to the one that moves).
"""

from __future__ import annotations

import itertools
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from enum import IntEnum
from functools import lru_cache
from typing import NamedTuple

from roboirg.core.episode import ObjectKind, Scene, SceneObject
from roboirg.core.motions import Point
from roboirg.core.object_sizes import BESIDE
from roboirg.language.landmarks import (
    MARGIN,
    ORDINALS,
    PAIRED,
    Frame,
    Ranking,
    alone_in_color,
    candidates_in,
    directions,
    fixtures_in,
    nearness,
    selectors,
    sideways,
)

Things = Sequence[SceneObject]


class PlaceClass(IntEnum):
    """What kind of place words name, in the order of preference."""

    EXTREME = 1
    """The first in a direction, *all the way on the right*, or the only one, *on the right*."""
    FIXTURE = 2
    """*nearest to the button*; where it is really near, *next to the button*."""
    SIDE_OF_FIXTURE = 3
    """The only one on that side: *to the left of the button*."""
    BETWEEN = 4
    """*between the button and the target*"""
    COLOR = 5
    """*nearest to the red cube*, *next to the red cube*"""
    RANK = 6
    """*second from the left*"""
    MIDDLE = 7
    """*in the middle*"""
    CORNER = 8
    """The only one in that quarter: *at the back left*, *in the front right corner*."""
    NEIGHBOR = 9
    """*nearest to the one all the way on the right*"""
    UNUSUAL = 10
    """What no one says: landmarks of language 3, *second nearest to the cube closest to you*."""


USUAL = PlaceClass.CORNER
"""The last class that people say without need; others only where there is none of these."""


class SpokenPlace(NamedTuple):
    """A place, and what stands there.

    Attributes:
        kind: class.
        thing: what the words single out, by the margin.
        attributive: words after a noun: *the cube* **nearest to the button**. None for the only
            thing of its kind on the table, which needs no telling apart.
        spot: words for where something happens: *the table wobbles* **right by the button**. None
            if the thing is not clearly there alone.
    """

    kind: PlaceClass
    thing: SceneObject
    attributive: str | None
    spot: str | None = None

    def said(self, form: str | None) -> str:
        """Return the words of the form ``spot``, or those after a noun; empty if there are none."""
        words = self.spot if form == "spot" else self.attributive
        return words or ""


# Cached: all forms of an episode ask for the same.
@lru_cache(maxsize=64)
def spoken_places(scene: Scene, thing: ObjectKind, frame: Frame) -> tuple[SpokenPlace, ...]:
    """Return all places of the things of a kind, from the best class to the last.

    Things are where the scene has them, at the start; what moves later is named by where it
    started. Cubes that arrive later are no things yet.
    """
    things = candidates_in(scene, thing)
    places: list[SpokenPlace] = []
    if things and thing not in PAIRED:
        places += _usual_places(scene, things, frame)
    for selector in selectors(scene, thing, frame):
        places += _said(PlaceClass.UNUSUAL, selector.select(), selector.landmark.phrase)
    if len(things) == 1:
        places = [place._replace(attributive=None) for place in places if place.spot]
    return tuple(sorted(places, key=lambda place: place.kind))


def _usual_places(scene: Scene, things: Things, frame: Frame) -> list[SpokenPlace]:
    """Return the places that people say, and the neighbors of what has one of the simplest."""
    places = list(_in_directions(things, frame))
    if frame == "robot":
        places += _corners(things)
        places += _on_sides(things, scene)
    anchors = list(_anchors(things, scene))
    for place in places:
        if place.attributive and place.kind in (PlaceClass.EXTREME, PlaceClass.CORNER):
            name = f"the one {place.attributive}"
            anchors.append(_Anchor(PlaceClass.NEIGHBOR, name, place.thing))
    for anchor in anchors:
        places += _near_anchor(anchor, things)
    places += _between(things, scene)
    places += _in_middle(things)
    return places


@lru_cache(maxsize=64)
def things_at(
    scene: Scene, thing: ObjectKind, frame: Frame
) -> Mapping[str | None, SceneObject | None]:
    """Return what each phrase for a place singles out, in either language; None if unclear."""
    found: dict[str | None, SceneObject | None] = {}
    for selector in selectors(scene, thing, frame):
        found[selector.landmark.phrase] = selector.select()
    for place in spoken_places(scene, thing, frame):
        found |= {place.attributive: place.thing, place.spot: place.thing}
    return found


def _said(
    kind: PlaceClass, thing: SceneObject | None, attributive: str | None, spot: str | None = None
) -> Iterator[SpokenPlace]:
    """Yield a place if something stands there, and if there are words for it."""
    if thing is not None and (attributive or spot):
        yield SpokenPlace(kind, thing, attributive, spot)


def _only(things: Things, ranking: Ranking, start: float) -> SceneObject | None:
    """Return the only thing whose quantity is at least `start`.

    None unless those of all others are less by the margin.
    """
    region = ranking._replace(quantity=lambda thing: min(ranking.quantity(thing), start))
    thing = region.select(things, 0)
    return thing if thing and ranking.quantity(thing) >= start else None


_CENTER = SceneObject("center", "site", Point(-0.05, 0.0, 0.0))
"""Of the work area."""
_CLEARLY = 2
"""Margins from the center from which a thing is clearly in a direction."""
_AROUND = 0.09
"""Meters from the center up to which a thing is in the middle."""
_DETOUR = 0.03
"""Meters that the way from one thing to another is longer over a third one between them."""


def _center_of(things: Things) -> SceneObject:
    """Return the center in front of the robot: of the work area, or as deep as the things are."""
    if len(things) == 1:
        return _CENTER
    depths = [thing.position.x for thing in things]
    return replace(_CENTER, position=Point((min(depths) + max(depths)) / 2, 0.0, 0.0))


class _Words(NamedTuple):
    """Words of a direction; None where no one says any.

    Attributes:
        most: for the first in that direction.
        far: where that one is ahead of all others.
        alone: for the only one clearly in that direction.
        spot: where that one is.
        row: after *second*.
    """

    most: str
    far: str | None = None
    alone: str | None = None
    spot: str | None = None
    row: str | None = None


def _sided(side: str) -> _Words:
    """Return the words for left or right."""
    there = f"on the {side}"
    return _Words(f"all the way {there}", f"on the far {side}", there, there, f"from the {side}")


_FRONT, _BACK = "all the way in the front", "all the way in the back"
_WORDS: Mapping[Frame, tuple[_Words, ...]] = {
    "robot": (
        _sided("left"),
        _sided("right"),
        _Words("closest to you", _FRONT, "in the front", "close to you", "closest to you"),
        _Words(_BACK, _BACK, "in the back", "in the back"),
    ),
    "camera": (
        _sided("left of the picture"),
        _sided("right of the picture"),
        _Words("closest to the robot", None, None, "close to the robot", "closest to the robot"),
        _Words("farthest from the robot", spot="far from the robot"),
    ),
}
"""By frame, in the order of `directions`."""


def _in_directions(things: Things, frame: Frame) -> Iterator[SpokenPlace]:
    """Yield the first in each direction, the only one there, and those in a row."""
    center = _center_of(things)
    for words, direction in zip(_WORDS[frame], directions(frame), strict=True):
        ranking = direction.ranking
        clearly = _CLEARLY * ranking.margin
        start = ranking.quantity(center) + clearly
        ahead = ranking._replace(margin=clearly).select(things, 0)
        is_far = ahead is not None and ranking.quantity(ahead) - start >= ranking.margin
        far = words.far if is_far else None
        yield from _said(PlaceClass.EXTREME, ranking.select(things, 0), words.most, far)
        alone = _only(things, ranking, start)
        yield from _said(PlaceClass.EXTREME, alone, words.alone, words.spot)
        for rank, ordinal in ORDINALS.items():
            # The last one in a row is the first from the other end. No one says "third closest".
            is_said = rank == 1 or words.row != words.most
            if words.row and is_said and rank < len(things) - 1:
                thing = ranking.select(things, rank)
                yield from _said(PlaceClass.RANK, thing, f"{ordinal} {words.row}")


class _Anchor(NamedTuple):
    """What is near something: a fixture, the only cube of a color, a thing with a place."""

    kind: PlaceClass
    name: str
    thing: SceneObject


def _anchors(things: Things, scene: Scene) -> Iterator[_Anchor]:
    for fixture in fixtures_in(scene):
        yield _Anchor(PlaceClass.FIXTURE, f"the {fixture.kind}", fixture)
    for thing in alone_in_color(things):
        yield _Anchor(PlaceClass.COLOR, f"the {thing.color} cube", thing)


def _near_anchor(anchor: _Anchor, things: Things) -> Iterator[SpokenPlace]:
    """Yield what is nearest to an anchor, right next to it, or farthest from it."""
    kind, name = anchor.kind, anchor.name
    others = [thing for thing in things if thing is not anchor.thing]
    if kind > PlaceClass.FIXTURE and len(others) <= 1:
        return  # only one thing could be meant
    near = nearness(anchor.thing.position)
    yield from _said(kind, near.select(others, 0), f"nearest to {name}")
    reach = anchor.thing.half_width + things[0].half_width + BESIDE
    beside = _only(others, near, -reach)
    if kind == PlaceClass.FIXTURE:
        yield from _said(kind, beside, f"next to {name}", f"right by {name}")
        yield from _said(kind, near.opposite.select(others, 0), f"farthest from {name}")
    if kind == PlaceClass.COLOR:
        yield from _said(kind, beside, f"next to {name}")


def _between(things: Things, scene: Scene) -> Iterator[SpokenPlace]:
    """Yield the only thing over which the way between two fixtures is hardly longer."""
    for first, second in itertools.combinations(fixtures_in(scene), 2):
        words = f"between the {first.kind} and the {second.kind}"
        shortest = nearness(first.position).quantity(second)
        thing = _only(things, _way_between(first, second), shortest - _DETOUR)
        yield from _said(PlaceClass.BETWEEN, thing, words, words)


def _way_between(first: SceneObject, second: SceneObject) -> Ranking:
    """Return the order of things by the way from one to the other over them, the shortest first."""
    near, far = nearness(first.position), nearness(second.position)
    # A thing that moves comes nearer to both, or goes away from both, by as much.
    return Ranking(lambda thing: near.quantity(thing) + far.quantity(thing), 2 * MARGIN)


def _in_middle(things: Things) -> Iterator[SpokenPlace]:
    """Yield the only thing around the center; of an odd row, only if it is its middle, too."""
    words = "in the middle"
    near = nearness(_center_of(things).position)
    around = _only(things, near, -_AROUND)
    if len(things) % 2 == 0:
        yield from _said(PlaceClass.MIDDLE, around, words, words)
        return
    row = directions("robot")[0].ranking
    middle = row.select(things, len(things) // 2)
    if middle is around:
        yield from _said(PlaceClass.MIDDLE, middle, words, words)
    elif middle is near.select(things, 0):
        yield from _said(PlaceClass.MIDDLE, middle, words)


def _corners(things: Things) -> Iterator[SpokenPlace]:
    """Yield the only thing in each quarter around the center, and in its corner."""
    left, right, near, far = (direction.ranking for direction in directions("robot"))
    center = _center_of(things)
    for depth, along in (("front", near), ("back", far)):
        for side, across in (("left", left), ("right", right)):
            quarter = _both_past(center, along, across)
            there, corner = f"at the {depth} {side}", f"in the {depth} {side} corner"
            yield from _said(PlaceClass.CORNER, _only(things, quarter, MARGIN), there, there)
            # Of the area where things stand: one alone is in none.
            spot = corner if len(things) > 1 else None
            thing = _only(things, quarter, _CLEARLY * MARGIN)
            yield from _said(PlaceClass.CORNER, thing, corner, spot)


def _both_past(start: SceneObject, along: Ranking, across: Ranking) -> Ranking:
    """Return the order of things by how far they are past another one in both directions."""

    def depth(thing: SceneObject) -> float:
        return min(
            along.quantity(thing) - along.quantity(start),
            across.quantity(thing) - across.quantity(start),
        )

    return Ranking(depth)


def _on_sides(things: Things, scene: Scene) -> Iterator[SpokenPlace]:
    """Yield the only thing left or right of a fixture, unless it is rather behind or before it."""
    for fixture in fixtures_in(scene):
        for direction in sideways("robot"):
            thing = _only(things, direction.ranking, direction.ranking.quantity(fixture))
            if thing and _is_sideways(thing, fixture):
                words = f"to the {direction.side} of the {fixture.kind}"
                yield from _said(PlaceClass.SIDE_OF_FIXTURE, thing, words)


def _is_sideways(thing: SceneObject, fixture: SceneObject) -> bool:
    sideward = abs(thing.position.y - fixture.position.y)
    return sideward >= abs(thing.position.x - fixture.position.x)
