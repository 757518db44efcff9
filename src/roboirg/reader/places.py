"""Places: what stands at a place on the table.

A place orders things along a direction, or by their distance from something, and means the first,
second, ... of that order. Where words can mean several measures or things, all of them are found.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from typing import Literal, NamedTuple

from roboirg.core.episode import ROBOT_BASE, Scene, SceneObject
from roboirg.core.motions import Away, Point

Side = Literal["left", "right"]
Things = Sequence[SceneObject]
Measure = Callable[[SceneObject], float]
"""The order of things, small values first."""

_TABLE = {"front": -0.7402, "back": 0.4689, "left": 1.2030, "right": -1.2149}
"""Edges of the table's top, x of the first two and y of the others in the world frame."""
_WORK_AREA = {"front": -0.3, "back": 0.2, "left": 0.25, "right": -0.25}
"""The same of the area where things stand."""
_CENTER_X = -0.05
"""Of the center of the work area."""
_SIDE_DISTANCE = 0.03
"""Meters from the center from which on more than the first thing may be *on the left*."""
_SIDE_TANGENT = 6 / 128
"""The same as a tangent: six pixels."""
_CAMERA = (0.3, 0.0, 0.4)
_VIEW = (-0.3, 0.0, -0.6)
"""The front camera's eye and where it looks from there."""
_CUBE_HEIGHT = 0.02
_TIE = 0.01
"""Meters; the same words may mean things that differ by less."""
_TANGENT_TIE = 2 / 128
"""Two pixels, as a tangent, of a picture with 256 columns and 90 degrees, whatever is observed."""
_WIDE_TIE = 0.03
"""Meters, for *next to*, *between* and *in the middle*."""


class Place(NamedTuple):
    """A place, as words name it.

    Attributes:
        kind: ``side``, ``depth`` and ``corner`` are directions; ``distance`` and ``between`` are
            about anchors; ``aside`` is to a side of an anchor; ``middle``.
        side: left or right of the robot, or of the picture.
        depth: +1 away from the robot, -1 towards it; of ``distance``, +1 for the farthest.
        rank: 1 for the first thing in this order.
        is_loose: whether *on the left* may mean any of several things there.
        is_mirrored: whether left and right are those of the front camera's picture.
        anchors: kinds of fixtures, or descriptions of things, for which `find_anchors` looks.
        group: where the few things stand among which it is; None for all.
        size: number of things in the group.
    """

    kind: Literal["side", "depth", "corner", "distance", "between", "aside", "middle"]
    side: Side | None = None
    depth: int = 0
    rank: int = 1
    is_loose: bool = False
    is_mirrored: bool = False
    anchors: tuple[object, ...] = ()
    group: Place | None = None
    size: int = 0


FindAnchors = Callable[[object], Things]
"""Returns all things that an anchor may mean."""


class _Nearness(NamedTuple):
    """Things in an order.

    Attributes:
        things: in no order yet.
        measure: the first thing has the smallest.
        tie: things that differ by no more may stand for each other.
    """

    things: Things
    measure: Measure
    tie: float

    def of_rank(self, rank: int) -> Things:
        """Return the things of a rank, from 1, with those that tie with them."""
        if rank > len(self.things):
            return ()
        wanted = sorted(map(self.measure, self.things))[rank - 1]
        return [thing for thing in self.things if abs(self.measure(thing) - wanted) <= self.tie]

    def on_side(self) -> Things:
        """Return the things clearly on the side from which the order counts, by some centimeters.

        They are past the center by 3 cm, or by six pixels in the picture.
        """
        # The center counts as a thing, so that it is measured like one.
        center = SceneObject("center", "site", Point(_center_x(self.things), 0.0, _CUBE_HEIGHT))
        aside = _SIDE_DISTANCE
        if self.tie == _TANGENT_TIE:
            aside = _SIDE_TANGENT
        start = self.measure(center) - aside
        return [thing for thing in self.things if self.measure(thing) <= start]


def find_objects(
    place: Place, candidates: Things, find_anchors: FindAnchors
) -> tuple[SceneObject, ...]:
    """Return the things that a place may mean: for *second from the left*, the second one.

    Several are returned where words can mean several orders, or where things tie: they differ by
    less than people see.

    Args:
        place: as words name it.
        candidates: the things.
        find_anchors: returns the things that *the button* or *the red cube* in it may mean.
    """
    things: list[SceneObject] = []
    if place.group is not None:
        place_in_group = place._replace(group=None)
        for few_things in _groups(place.group, place.size, candidates, find_anchors):
            things += find_objects(place_in_group, few_things, find_anchors)
        return tuple(dict.fromkeys(things))
    for order in _orders(place, candidates, find_anchors):
        things += order.of_rank(place.rank)
        if place.is_loose and place.kind != "distance":
            things += order.on_side()
    return tuple(dict.fromkeys(things))


def things_of(scene: Scene, kind: str) -> Things:
    """Return the things of a kind, open or hidden, without cubes that appear later."""
    if kind != "cube":
        return scene.of_kind(kind)
    arriving_later = {motion.subject for motion in scene.motions_of(Away) if motion.start == 0}
    cubes = [*scene.of_kind("cube"), *scene.of_kind("hidden_cube")]
    return [cube for cube in cubes if cube.name not in arriving_later]


def _groups(
    place: Place, size: int, candidates: Things, find_anchors: FindAnchors
) -> Iterator[Things]:
    """Yield the few things that words like *the two in the back* may mean, here the two farthest.

    `size` is their number. Two such groups are yielded if the last thing in the first one and the
    next thing tie: they are about as far.
    """
    for order in _orders(place, candidates, find_anchors):
        ordered = sorted(order.things, key=order.measure)
        if place.rank != 1 or not 0 < size < len(ordered):
            continue  # "the second on the left" is no group, and neither are all things
        *certain, last = ordered[:size]
        following = ordered[size]
        yield [*certain, last]
        if order.measure(following) - order.measure(last) <= order.tie:
            yield [*certain, following]


def _orders(place: Place, candidates: Things, find_anchors: FindAnchors) -> Iterator[_Nearness]:
    """Yield the orders of things that words for a place can mean, each with its measure.

    *second from the left* is an order from the left, of which the second thing is meant; *nearest
    to the bin*, one by the distance from the bin. An anchor is what such words name, here the bin.
    """
    if place.kind in ("side", "depth", "corner", "middle"):
        yield from _direction_orders(place, candidates)
        return
    first_anchors, *other_anchors = [find_anchors(anchor) for anchor in place.anchors]
    for anchor in first_anchors:
        if place.kind == "between":
            for other in other_anchors[0]:
                yield _order_between(anchor, other, candidates)
        elif place.kind == "aside":
            yield _on_side_of(place, anchor, candidates)
        else:
            yield _order_by_distance(place, anchor, candidates)


def _order_between(anchor: SceneObject, other: SceneObject, candidates: Things) -> _Nearness:
    """Return the order by the way from one thing to another over a third, shortest first."""
    others = [thing for thing in candidates if thing not in (anchor, other)]
    return _Nearness(others, _detour(anchor, other), _WIDE_TIE)


def _on_side_of(place: Place, anchor: SceneObject, candidates: Things) -> _Nearness:
    """Return the things on one side of another thing, all alike: any of them may be meant."""
    across = _sideways(place)
    aside: list[SceneObject] = []
    for thing in candidates:
        if thing is not anchor and across(thing) < across(anchor):
            aside.append(thing)
    return _Nearness(aside, lambda _thing: 0.0, 0.0)


def _order_by_distance(place: Place, anchor: SceneObject, candidates: Things) -> _Nearness:
    """Return the order by the distance from an anchor, the nearest first, or the farthest."""
    others = [thing for thing in candidates if thing is not anchor]
    tie = _WIDE_TIE if place.is_loose else _TIE
    sign = -1.0 if place.depth > 0 else 1.0
    return _Nearness(others, _distance(anchor.position[:2], sign), tie)


def _direction_orders(place: Place, candidates: Things) -> Iterator[_Nearness]:
    """Yield the orders of things along a direction, or from a corner or the middle of the table.

    *closest to you* may mean by depth or by distance, so both orders are yielded. Things whose
    measures differ by up to the tie (1 cm, or two pixels in the picture) may stand for each other.
    """
    if place.kind == "side":
        tie = _TANGENT_TIE if place.is_mirrored else _TIE
        yield _Nearness(candidates, _sideways(place), tie)
    elif place.kind == "depth":
        # People may mean depth or distance; what stands aside is farther away than it is deep.
        yield _Nearness(candidates, lambda thing: -place.depth * thing.position.x, _TIE)
        yield _Nearness(candidates, _distance(ROBOT_BASE[:2], -place.depth), _TIE)
    elif place.kind == "corner":
        yield from _corner_orders(place, candidates)
    else:
        yield from _middle_orders(candidates)


def _corner_orders(place: Place, candidates: Things) -> Iterator[_Nearness]:
    """Yield the orders by the distance from a corner of the table, and of the work area."""
    end = "back" if place.depth > 0 else "front"
    is_left = (place.side == "left") != place.is_mirrored
    side = "left" if is_left else "right"
    for area in (_TABLE, _WORK_AREA):
        yield _Nearness(candidates, _distance((area[end], area[side])), _TIE)


def _middle_orders(candidates: Things) -> Iterator[_Nearness]:
    """Yield the orders in which the thing *in the middle* is first.

    One is by the distance from the center. Of an odd number of things, another one is by the
    distance from the middle thing, counted from left to right.
    """
    yield _Nearness(candidates, _distance((_center_x(candidates), 0.0)), _WIDE_TIE)
    if len(candidates) % 2 == 1:
        positions_y = sorted(thing.position.y for thing in candidates)
        middle = positions_y[len(positions_y) // 2]
        yield _Nearness(candidates, lambda thing: abs(thing.position.y - middle), _TIE)


def _center_x(things: Things) -> float:
    """Return the x of the center: of the work area, or halfway between the things."""
    if len(things) < 2:  # noqa: PLR2004
        return _CENTER_X
    depths = [thing.position.x for thing in things]
    return (min(depths) + max(depths)) / 2


def _sideways(place: Place) -> Measure:
    """Return the measure of a side."""
    sign = -1.0 if place.side == "left" else 1.0
    if place.is_mirrored:
        return lambda thing: sign * _tangent(thing)
    return lambda thing: sign * thing.position.y


def _distance(place: Sequence[float], sign: float = 1.0) -> Measure:
    """Return the measure of the distance from x and y; with the sign -1, the farthest is first."""
    return lambda thing: sign * math.dist(thing.position[:2], place)


def _detour(first: SceneObject, second: SceneObject) -> Measure:
    """Return how long the way between two things is over another one."""
    to_first = _distance(first.position[:2])
    to_second = _distance(second.position[:2])
    return lambda thing: to_first(thing) + to_second(thing)


def _tangent(thing: SceneObject) -> float:
    """Return the tangent of the horizontal angle from the front camera's axis to something."""
    to_x, to_y = thing.position.x - _CAMERA[0], thing.position.y - _CAMERA[1]
    ahead = to_x * _VIEW[0] + to_y * _VIEW[1] + (_CUBE_HEIGHT - _CAMERA[2]) * _VIEW[2]
    return -thing.position.y * math.hypot(*_VIEW) / ahead
