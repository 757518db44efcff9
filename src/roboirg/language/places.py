"""Places as people say them: words for where a thing stands.

A place has two wordings. *All the way on the right* follows a noun and singles out one of several
things; *on the far right* says where something is or happens, and needs a truth of its own: the
thing stands clearly there, and no other one does. Left and right are those of a frame, as in
`landmarks`, and its margins hold: if one thing moves by less, no phrase goes over to another thing
(by half of it, if others are named as near to the one that moves). Where people mean one of two
measures, such as depth and distance, words are said only if they are true by both.
"""

from __future__ import annotations

import itertools
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from enum import IntEnum
from functools import lru_cache
from typing import NamedTuple

from roboirg.core.episode import ROBOT_BASE, ObjectKind, Scene, SceneObject
from roboirg.core.motions import Point
from roboirg.core.object_sizes import BESIDE
from roboirg.language.landmarks import (
    MARGIN,
    ORDINALS,
    PAIRED,
    Frame,
    Ranking,
    agreed,
    alone_in_color,
    candidates_in,
    corner_rankings,
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
    RANK = 5
    """*second from the left*"""
    MIDDLE = 6
    """*in the middle*"""
    CORNER = 7
    """The only one in and around that quarter: *at the back left*, *in the front right corner*."""
    NEAR_CORNER = 8
    """*nearest to the back left corner*, for one that is not said to be there."""
    COLOR = 9
    """*nearest to the red cube*, *next to the red cube*; *it* may then mean that one."""
    UNUSUAL = 10
    """What no one says, *third closest to you*, and `landmarks`; where there is nothing else."""


class SpokenPlace(NamedTuple):
    """Words for where a thing stands, and the thing.

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

    def said(self, form: str | None = None) -> str:
        """Return the words in a form; empty if there are none.

        Args:
            form: ``spot`` for where something happens, *right by the button*; any other, or None,
                for words after a noun, *nearest to the button*.
        """
        words = self.spot if form == "spot" else self.attributive
        return words or ""


# Cached: all forms of an episode ask for the same.
@lru_cache(maxsize=64)
def spoken_places(scene: Scene, kind: ObjectKind, frame: Frame) -> tuple[SpokenPlace, ...]:
    """Return all words for where things of a kind stand, each with its thing, best words first.

    Things are where the scene has them, at the start; what moves later is named by where it
    started. Cubes that arrive later are left out. If there is only one thing, only words for where
    something happens are returned (*on the left*), since it needs no telling apart. The order must
    stay: words of texts are drawn from it.

    Args:
        scene: with the things.
        kind: of the things.
        frame: whose left and right is meant, the robot's or the camera picture's.
    """
    things = candidates_in(scene, kind)
    places: list[SpokenPlace] = []
    if things and kind not in PAIRED:
        places += _places_of(scene, things, frame)
    places += _landmarks(scene, kind, frame)
    if len(things) == 1:
        places = [place._replace(attributive=None) for place in places if place.spot]
    return tuple(sorted(places, key=lambda place: place.kind))


def _landmarks(scene: Scene, kind: ObjectKind, frame: Frame) -> Iterator[SpokenPlace]:
    """Yield the words of the module `landmarks` as places of the last class, hardly said.

    *second nearest to the button*. Words by depth, *closest to you*, are left out, as they may be
    wrong by distance. Boxes and tapes come in pairs, and the words for their sides also say where
    something happens.
    """
    is_paired = kind in PAIRED
    for selector in selectors(scene, kind, frame):
        if selector.is_in_depth:
            continue  # it may be wrong by distance
        spot = selector.phrase if is_paired else None
        yield from _place_if_any(PlaceClass.UNUSUAL, selector.select(), selector.phrase, spot)


def _places_of(scene: Scene, things: Things, frame: Frame) -> Iterator[SpokenPlace]:
    """Yield the words for where things stand, of all classes that people say.

    Corners and sides of a fixture are said in the robot's frame only. `spoken_places` sorts them by
    class and keeps the order within one, from which words are drawn, so the order here must stay.
    """
    yield from _in_directions(things, frame)
    if frame == "robot":
        yield from _corners(things)
        yield from _on_sides(things, scene)
    yield from _near_others(things, scene)
    yield from _between(things, scene)
    yield from _in_middle(things)


@lru_cache(maxsize=64)
def things_at(scene: Scene, kind: ObjectKind, frame: Frame) -> Mapping[str, SceneObject | None]:
    """Return the thing that each phrase for a place singles out; None where that is unclear.

    ``{"on the left": <a cube>, "in the middle": <another>}``
    """
    found: dict[str, SceneObject | None] = {}
    for selector in selectors(scene, kind, frame):
        found[selector.phrase] = selector.select()
    for place in spoken_places(scene, kind, frame):
        for words in (place.attributive, place.spot):
            if words is not None:
                found[words] = place.thing
    return found


def _place_if_any(
    kind: PlaceClass, thing: SceneObject | None, attributive: str | None, spot: str | None = None
) -> Iterator[SpokenPlace]:
    """Yield a place, if a thing stands there and there are words for it; else nothing.

    Args:
        kind: class of the place.
        thing: what stands there; None if that is unclear.
        attributive: words after a noun; None without any.
        spot: words for where something happens; None without any.
    """
    if thing is not None and (attributive or spot):
        yield SpokenPlace(kind, thing, attributive, spot)


def _only_beyond(things: Things, ranking: Ranking, start: float) -> SceneObject | None:
    """Return the only thing whose quantity is at least `start`; None if none or several are.

    None also if another thing comes closer to `start` than the margin. With the distance to the
    left of the center as the quantity and 0.06 m as `start`: the only thing that is clearly on the
    left.

    Args:
        things: that are compared.
        ranking: the quantity, and its margin.
        start: from which a quantity counts, in the unit of the quantity.
    """
    # Things beyond the start count as equal, so that two of them are no clear first one.
    capped_ranking = ranking._replace(quantity=lambda thing: min(ranking.quantity(thing), start))
    thing = capped_ranking.select(things, 0)
    if thing is None or ranking.quantity(thing) < start:
        return None
    return thing


_CENTER = SceneObject("center", "site", Point(-0.05, 0.0, 0.0))
"""The center of the work area."""
_CLEAR_MARGINS = 2
"""Margins from the center from which a thing is clearly in a direction."""
_MIDDLE_RADIUS = 0.09
"""Meters from the center up to which a thing is in the middle."""
_QUARTER_DISTANCE = 0.06
"""Meters in both directions from the center from which a thing is at the back left, and so on."""
_CORNER_DISTANCE = 0.1
"""The same from which it is in the back left corner."""
_FAR_MARGINS = 3
"""Margins from the center from which a thing is on the far side."""
_FAR_MARGINS_ALONE = 5
"""The same for the only thing there is."""
_MAX_DETOUR = 0.03
"""Meters that the way from one thing to another is longer over a third one between them."""


def _center_of(things: Things) -> SceneObject:
    """Return the center in front of the robot from which things count as left, right, near or far.

    For several things it is as deep as their middle; for a single one it is the work area's center.
    """
    if len(things) == 1:
        return _CENTER
    depths = [thing.position.x for thing in things]
    return replace(_CENTER, position=Point((min(depths) + max(depths)) / 2, 0.0, 0.0))


def _distance_past(center: SceneObject, ranking: Ranking) -> Ranking:
    """Return the order of things by how far they are past a center in the direction of a ranking.

    The quantity is negative for things on the other side of it.
    """
    start = ranking.quantity(center)
    return ranking._replace(quantity=lambda thing: ranking.quantity(thing) - start)


def _is_past_work_center(thing: SceneObject | None, *rankings: Ranking) -> bool:
    """Return whether a thing is clearly past the work area's center in each of some directions.

    Clearly is by `MARGIN`, 3 cm. A ranking measures how far things are in its direction. None, no
    thing, is not past it.
    """
    if thing is None:
        return False
    for ranking in rankings:
        if ranking.quantity(thing) < ranking.quantity(_CENTER) + MARGIN:
            return False
    return True


class _DirectionWords(NamedTuple):
    """The words of a direction, here to the left; None where no one says any.

    Attributes:
        most: for the first in that direction, *all the way on the left*.
        far: where that one is ahead of all others, *on the far left*.
        alone: for the only one clearly in that direction, *on the left*.
        spot: where that one is, *on the left*.
        row: after *second*, *from the left*.
    """

    most: str
    far: str | None = None
    alone: str | None = None
    spot: str | None = None
    row: str | None = None


_FRONT = "all the way in the front"
_BACK = "all the way in the back"


def _sided(side: str) -> _DirectionWords:
    """Return the words for the direction ``left`` or ``right``."""
    there = f"on the {side}"
    return _DirectionWords(
        f"all the way {there}", f"on the far {side}", there, there, f"from the {side}"
    )


_WORDS_BY_FRAME: Mapping[Frame, tuple[_DirectionWords, ...]] = {
    "robot": (
        _sided("left"),
        _sided("right"),
        _DirectionWords("closest to you", _FRONT, "in the front", "in the front", "closest to you"),
        _DirectionWords(_BACK, _BACK, "in the back", "in the back"),
    ),
    "camera": (
        _sided("left of the picture"),
        _sided("right of the picture"),
        _DirectionWords(
            "closest to the robot", None, None, "close to the robot", "closest to the robot"
        ),
        _DirectionWords("farthest from the robot", spot="far from the robot"),
    ),
}
"""By frame, in the order of `directions`."""


def _in_directions(things: Things, frame: Frame) -> Iterator[SpokenPlace]:
    """Yield the words for the things at the left, right, front and back, each with its thing.

    *all the way on the left*, *on the left*, *second from the left* …; the frame says whose left
    and
    right: the robot's, or that of the front camera's picture. Words by depth must also be right by
    the distance from the robot.
    """
    left_words, right_words, near_words, far_words = _WORDS_BY_FRAME[frame]
    to_left, to_right, in_front, behind = directions(frame)
    yield from _in_direction(things, left_words, to_left.ranking)
    yield from _in_direction(things, right_words, to_right.ranking)
    closeness = nearness(ROBOT_BASE)
    yield from _in_depth(things, near_words, in_front.ranking, closeness)
    yield from _in_depth(things, far_words, behind.ranking, closeness.opposite)


def _in_depth(
    things: Things, words: _DirectionWords, by_depth: Ranking, by_distance: Ranking
) -> Iterator[SpokenPlace]:
    """Yield words for near or far things that are right by depth and by distance from the robot.

    A thing far to the side is farther from the robot than it is deep, and people may mean either,
    so only words that both orders give to the same thing are yielded.

    Args:
        things: that are compared.
        words: of the direction.
        by_depth: the order by x.
        by_distance: the order by the distance from the robot.
    """
    right_by_distance = set(_in_direction(things, words, by_distance))
    for place in _in_direction(things, words, by_depth):
        if place in right_by_distance:
            yield place


def _in_direction(
    things: Things, words: _DirectionWords, ranking: Ranking
) -> Iterator[SpokenPlace]:
    """Yield words in one direction, here the left, each with the thing that it singles out.

    They are the first one, *all the way on the left*; one that is far ahead, *on the far left*; the
    only one there, *on the left*; and those after the first, *second from the left*.

    Args:
        things: that are compared.
        words: of the direction.
        ranking: the order of things, the first in the direction first.
    """
    yield from _place_if_any(PlaceClass.EXTREME, ranking.select(things, 0), words.most)

    past_center = _distance_past(_center_of(things), ranking)
    thing_ahead = _far_ahead(things, ranking, past_center)
    yield from _place_if_any(PlaceClass.EXTREME, thing_ahead, None, words.far)

    # The only one past the center is simply "on the left".
    thing_alone = _only_beyond(things, past_center, _CLEAR_MARGINS * ranking.margin)
    if _is_past_work_center(thing_alone, ranking):
        yield from _place_if_any(PlaceClass.EXTREME, thing_alone, words.alone, words.spot)

    if words.row is not None:
        yield from _in_row(things, words, ranking)


def _far_ahead(things: Things, ranking: Ranking, past_center: Ranking) -> SceneObject | None:
    """Return the thing that is *on the far left*: well ahead of all others, far from the center.

    None if there is none. Both rankings are from left to right; the quantity of `past_center` is
    how far things are past the center.
    """
    wide_ranking = ranking._replace(margin=_CLEAR_MARGINS * ranking.margin)
    thing = wide_ranking.select(things, 0)
    margins = _FAR_MARGINS if len(things) > 1 else _FAR_MARGINS_ALONE
    if thing is None or past_center.quantity(thing) < ranking.margin * margins:
        return None
    return thing


def _in_row(things: Things, words: _DirectionWords, ranking: Ranking) -> Iterator[SpokenPlace]:
    """Yield words for the things after the first one in a direction: *second from the left*.

    The last one gets no such words, since it is the first from the other end.

    Args:
        things: that are compared.
        words: of the direction; they must have those for a row.
        ranking: the order of things, the first in the direction first.
    """
    for rank, ordinal in ORDINALS.items():
        if rank >= len(things) - 1:
            return  # the last one in a row is the first from the other end
        kind = PlaceClass.RANK
        if rank > 1 and words.row == words.most:
            kind = PlaceClass.UNUSUAL  # no one says "third closest"
        yield from _place_if_any(kind, ranking.select(things, rank), f"{ordinal} {words.row}")


def _near_others(things: Things, scene: Scene) -> Iterator[SpokenPlace]:
    """Yield words by another thing: *next to the button*, *nearest to the red cube*.

    The others are fixtures (button, target or bin, if there is one only) and cubes that are alone
    in their color. A fixture also gives *farthest from the button*.
    """
    for fixture in fixtures_in(scene):
        name = f"the {fixture.kind}"
        yield from _near(fixture, name, things, PlaceClass.FIXTURE)
        farness = nearness(fixture.position).opposite
        yield from _place_if_any(
            PlaceClass.FIXTURE, farness.select(things, 0), f"farthest from {name}"
        )
    for cube in alone_in_color(things):
        others = [thing for thing in things if thing is not cube]
        if len(others) > 1:  # else only one thing could be meant
            yield from _near(cube, f"the {cube.color} cube", others, PlaceClass.COLOR)


def _near(
    anchor: SceneObject, name: str, things: Things, kind: PlaceClass
) -> Iterator[SpokenPlace]:
    """Yield *nearest to the button* and *next to the button*, each for the thing that is so.

    *Next to* is for the only thing within a few centimeters (`BESIDE`) of touching the button. By a
    fixture it also says where something happens, *right by the button*.

    Args:
        anchor: near which things are looked for, here the button.
        name: words for it, *the button*.
        things: that may be near it; at least one.
        kind: class of the places.
    """
    nearness_to_anchor = nearness(anchor.position)
    yield from _place_if_any(kind, nearness_to_anchor.select(things, 0), f"nearest to {name}")

    reach = anchor.half_width + things[0].half_width + BESIDE
    # The quantity of nearness is the distance with a minus sign.
    neighbor = _only_beyond(things, nearness_to_anchor, -reach)
    spot = None
    if kind == PlaceClass.FIXTURE:
        spot = f"right by {name}"
    yield from _place_if_any(kind, neighbor, f"next to {name}", spot)


def _between(things: Things, scene: Scene) -> Iterator[SpokenPlace]:
    """Yield *between the button and the target* for the only thing between two such fixtures.

    The way from one to the other over this thing is at most 3 cm longer than the direct way.
    """
    for first, second in itertools.combinations(fixtures_in(scene), 2):
        words = f"between the {first.kind} and the {second.kind}"
        shortest = nearness(first.position).quantity(second)
        thing = _only_beyond(things, _way_between(first, second), shortest - _MAX_DETOUR)
        yield from _place_if_any(PlaceClass.BETWEEN, thing, words, words)


def _way_between(first: SceneObject, second: SceneObject) -> Ranking:
    """Return the order of things by the way from one object to another over them, shortest first.

    As nearness is the distance with a minus sign, the quantity is that way with a minus sign.
    """
    near, far = nearness(first.position), nearness(second.position)
    # A thing that moves comes nearer to both, or goes away from both, by as much.
    return Ranking(lambda thing: near.quantity(thing) + far.quantity(thing), 2 * MARGIN)


def _in_middle(things: Things) -> Iterator[SpokenPlace]:
    """Yield *in the middle* for the thing that is nearest to the center, if it can be called so.

    It has to be the nearest to the center of the work area and to that of the things, since people
    may mean either. Of an even number of things, it must be the only one around the center; of an
    odd number, it must be the middle one from left to right. Only a thing that is alone around the
    center also says where something happens, as a spot.
    """
    nearness_to_area_center = nearness(_CENTER.position)
    nearness_to_their_center = nearness(_center_of(things).position)
    nearest = agreed(
        [nearness_to_area_center.select(things, 0), nearness_to_their_center.select(things, 0)]
    )
    if nearest is None:
        return
    words = "in the middle"
    is_around = nearest is _only_beyond(things, nearness_to_their_center, -_MIDDLE_RADIUS)
    spot = words if is_around else None
    is_meant = is_around
    if len(things) % 2 == 1:
        from_left = directions("robot")[0].ranking
        is_meant = nearest is from_left.select(things, len(things) // 2)
    if is_meant:
        yield SpokenPlace(PlaceClass.MIDDLE, nearest, words, spot)


class _Corner(NamedTuple):
    """A corner of the table in front of the robot.

    Attributes:
        depth: ``near`` or ``far``.
        side: ``left`` or ``right``.
        name: as people say, *back left*.
        along: the order of things toward its depth.
        across: the order of things toward its side.
    """

    depth: str
    side: str
    name: str
    along: Ranking
    across: Ranking

    def nearest(self, things: Things) -> SceneObject | None:
        """Return the thing that is clearly the nearest to the corner; None if there is none."""
        found: list[SceneObject | None] = []
        for ranking in corner_rankings(self.depth, self.side):
            clear = ranking._replace(margin=_CLEAR_MARGINS * MARGIN)
            found.append(clear.select(things, 0))
        return agreed(found)

    def quarter(self, center: SceneObject) -> Ranking:
        """Return the order of things by how far they are in the corner's quarter around a center.

        The quantity is the lesser of two: how far a thing is past the center toward the corner's
        depth, and toward its side. It is negative outside of the quarter.
        """
        along = _distance_past(center, self.along)
        across = _distance_past(center, self.across)
        # A wide margin: what is hardly outside of a quarter may still pass for being in it.
        return Ranking(
            lambda thing: min(along.quantity(thing), across.quantity(thing)),
            _CLEAR_MARGINS * MARGIN,
        )


def _corners(things: Things) -> Iterator[SpokenPlace]:
    """Yield words for the thing nearest to each of the four corners of the table, with the thing.

    *at the back left*, *in the back left corner*, *nearest to the back left corner*; left and right
    are the robot's, and the front is near the robot.
    """
    left, right, near, far = (direction.ranking for direction in directions("robot"))
    corners = (
        _Corner("near", "left", "front left", near, left),
        _Corner("near", "right", "front right", near, right),
        _Corner("far", "left", "back left", far, left),
        _Corner("far", "right", "back right", far, right),
    )
    for corner in corners:
        yield from _at_corner(things, corner)


def _at_corner(things: Things, corner: _Corner) -> Iterator[SpokenPlace]:
    """Yield words for the thing nearest to a corner, if one is clearly the nearest.

    Alone in that quarter of the table, it is *at the back left*, and close enough to the corner
    also *in the back left corner*. Else it is *nearest to the back left corner*, which is no spot:
    it does not say where something happens.
    """
    nearest = corner.nearest(things)
    if nearest is None:
        return
    quarter = corner.quarter(_center_of(things))
    is_alone = nearest is _only_beyond(things, quarter, _QUARTER_DISTANCE)
    if not is_alone or not _is_past_work_center(nearest, corner.along, corner.across):
        yield SpokenPlace(PlaceClass.NEAR_CORNER, nearest, f"nearest to the {corner.name} corner")
        return
    there = f"at the {corner.name}"
    yield SpokenPlace(PlaceClass.CORNER, nearest, there, there)
    if quarter.quantity(nearest) >= _CORNER_DISTANCE:
        words = f"in the {corner.name} corner"
        # One thing alone on the table stands in no corner.
        spot = words if len(things) > 1 else None
        yield SpokenPlace(PlaceClass.CORNER, nearest, words, spot)


def _on_sides(things: Things, scene: Scene) -> Iterator[SpokenPlace]:
    """Yield *to the left of the button* for the only thing on that side of a fixture.

    Fixtures are the button, target and bin. A thing that is rather behind or in front of the
    fixture than aside of it gets no words.
    """
    for fixture in fixtures_in(scene):
        for direction in sideways("robot"):
            order = direction.ranking
            thing = _only_beyond(things, order, order.quantity(fixture))
            if thing and _is_sideways(thing, fixture):
                words = f"to the {direction.side} of the {fixture.kind}"
                yield SpokenPlace(PlaceClass.SIDE_OF_FIXTURE, thing, words)


def _is_sideways(thing: SceneObject, fixture: SceneObject) -> bool:
    """Return whether a thing is rather aside of a fixture than behind or before it.

    Aside is along y, behind and before along x; at 45 degrees it counts as aside.
    """
    sideward = abs(thing.position.y - fixture.position.y)
    return sideward >= abs(thing.position.x - fixture.position.x)
