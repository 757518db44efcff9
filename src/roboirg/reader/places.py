"""Find the objects that a description of a place may mean: *second from the left*.

A place sorts objects by a key, such as their distance from something, and means the first, second,
... of them. Where the words can mean several keys, or objects tie, all candidates are found.

Frames and units: meters in the world frame, x away from the robot, y to its left.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from typing import Literal, NamedTuple

from roboirg.core.episode import ROBOT_BASE, Scene, SceneObject
from roboirg.core.motions import Away, Point

Side = Literal["left", "right"]
Things = Sequence[SceneObject]
SortKey = Callable[[SceneObject], float]
"""Returns the number by which objects are sorted, smallest first."""

_TABLE = {"front": -0.7402, "back": 0.4689, "left": 1.2030, "right": -1.2149}
"""Edges of the table top: x of ``front`` and ``back``, y of ``left`` and ``right``."""
_WORK_AREA = {"front": -0.3, "back": 0.2, "left": 0.25, "right": -0.25}
"""Edges of the area where objects stand, likewise."""
_CENTER_X = -0.05
"""Of the center of the work area."""
_SIDE_DISTANCE = 0.03
"""Meters from the center from which on more than the first object may be *on the left*."""
_SIDE_TANGENT = 6 / 128
"""The same in the camera's picture, as the tangent of an angle: six pixels."""
_CAMERA = (0.3, 0.0, 0.4)
"""Position of the front camera."""
_VIEW = (-0.3, 0.0, -0.6)
"""Direction in which it looks, not normalized."""
_CUBE_HEIGHT = 0.02
_TOLERANCE = 0.01
"""Meters; objects that differ by less may be confused, so the same words may mean either."""
_TANGENT_TOLERANCE = 2 / 128
"""The same as a tangent: two pixels of a picture of 256 columns and 90 degrees."""
_WIDE_TOLERANCE = 0.03
"""Meters, for vague words: *next to*, *between* and *in the middle*."""


class Place(NamedTuple):
    """What words say about where an object stands.

    | words | place |
    | --- | --- |
    | *on the left* | ``Place("side", side="left", allows_several=True)`` |
    | *second from the left* | ``Place("side", side="left", rank=2)`` |
    | *closest to you* | ``Place("depth", depth=-1)`` |
    | *at the back left* | ``Place("corner", side="left", depth=1)`` |
    | *in the middle* | ``Place("middle")`` |
    | *farthest from the bin* | ``Place("distance", depth=1, anchors=("bin",))`` |
    | *between the bin and the button* | ``Place("between", anchors=("bin", "button"))`` |
    | *to the left of the bin* | ``Place("aside", side="left", anchors=("bin",))`` |

    Attributes:
        kind: the criterion, as in the table.
        side: left or right; None where the words name none.
        depth: +1 away from the robot, -1 towards it; of ``distance``, +1 for the farthest and -1
            for the nearest.
        rank: 1 for the first object by the criterion.
        allows_several: whether the words are vague, so that several objects may be meant.
        is_in_picture: whether left and right are those of the front camera's picture, not the
            robot's.
        anchors: reference objects, for which `FindAnchors` looks: the kind of a fixture,
            ``"bin"``, or the `roboirg.reader.things.Description` of a thing.
        group: where the few objects stand among which it is, *the left one of the two in the back*;
            None for all objects.
        group_size: how many these are.
    """

    kind: Literal["side", "depth", "corner", "distance", "between", "aside", "middle"]
    side: Side | None = None
    depth: int = 0
    rank: int = 1
    allows_several: bool = False
    is_in_picture: bool = False
    anchors: tuple[object, ...] = ()
    group: Place | None = None
    group_size: int = 0


FindAnchors = Callable[[object], Things]
"""Returns all objects that an anchor of a place may mean; none if it fits nothing."""


class _Ordering(NamedTuple):
    """Objects and the key that sorts them, for one meaning of a place.

    Attributes:
        things: the objects, unsorted.
        key: of each object, smallest first.
        tolerance: objects whose keys differ by no more than this tie.
        side_margin: how far the key of an object *on the left* is from that of the center.
    """

    things: Things
    key: SortKey
    tolerance: float
    side_margin: float = _SIDE_DISTANCE

    def of_rank(self, rank: int) -> Things:
        """Return the object of a rank, 1 for the first, and all that tie with it."""
        if rank > len(self.things):
            return ()
        wanted = sorted(map(self.key, self.things))[rank - 1]
        return [thing for thing in self.things if abs(self.key(thing) - wanted) <= self.tolerance]

    def on_side(self) -> Things:
        """Return the objects that are clearly on the side where the order begins.

        For *on the left*, all that are left of the center by the margin.
        """
        # The center counts as an object, so that the same key applies to it.
        center = SceneObject("center", "site", Point(_center_x(self.things), 0.0, _CUBE_HEIGHT))
        start = self.key(center) - self.side_margin
        return [thing for thing in self.things if self.key(thing) <= start]


def find_objects(
    place: Place, candidates: Things, find_anchors: FindAnchors
) -> tuple[SceneObject, ...]:
    """Return the candidates that a place may mean: for *second from the left*, the second one.

    Several are returned where the words can mean several orders, or where objects tie: they differ
    by less than people see. Each is returned once.

    Args:
        place: as words name it.
        candidates: the objects to choose from.
        find_anchors: returns the objects that an anchor, *the button* or *the red cube*, may mean.
    """
    things: list[SceneObject] = []
    if place.group is not None:
        place_in_group = place._replace(group=None)
        for group in _groups(place.group, place.group_size, candidates, find_anchors):
            things += find_objects(place_in_group, group, find_anchors)
        return tuple(dict.fromkeys(things))
    for ordering in _orderings(place, candidates, find_anchors):
        things += ordering.of_rank(place.rank)
        if place.allows_several and place.kind != "distance":
            things += ordering.on_side()
    return tuple(dict.fromkeys(things))


def things_of(scene: Scene, kind: str) -> Things:
    """Return the objects of a kind at the start; of kind ``cube`` also those under containers.

    Cubes that appear later in the episode are left out.
    """
    if kind != "cube":
        return scene.of_kind(kind)
    arriving_later = {motion.subject for motion in scene.motions_of(Away) if motion.start == 0}
    cubes = [*scene.of_kind("cube"), *scene.of_kind("hidden_cube")]
    return [cube for cube in cubes if cube.name not in arriving_later]


def _groups(
    place: Place, size: int, candidates: Things, find_anchors: FindAnchors
) -> Iterator[Things]:
    """Yield the groups of objects that words like *the two in the back* may mean.

    For a size of 2 these are the two farthest objects. If the second and the third tie, a second
    group is yielded, in which the third stands in for the second.
    """
    for ordering in _orderings(place, candidates, find_anchors):
        in_order = sorted(ordering.things, key=ordering.key)
        if place.rank != 1 or not 0 < size < len(in_order):
            continue  # "the second on the left" is no group, and neither are all objects
        *certain, last = in_order[:size]
        following = in_order[size]
        yield [*certain, last]
        if ordering.key(following) - ordering.key(last) <= ordering.tolerance:
            yield [*certain, following]


def _orderings(place: Place, candidates: Things, find_anchors: FindAnchors) -> Iterator[_Ordering]:
    """Yield an ordering of the candidates for each meaning that a place can have.

    *second from the left* has one, from the left; *nearest to the red cube* one for each object
    that *the red cube* may mean.
    """
    if place.kind in ("side", "depth", "corner", "middle"):
        yield from _direction_orderings(place, candidates)
        return
    first_anchors, *other_anchors = [find_anchors(anchor) for anchor in place.anchors]
    for anchor in first_anchors:
        if place.kind == "between":
            for other in other_anchors[0]:
                yield _between(anchor, other, candidates)
        elif place.kind == "aside":
            yield _on_side_of(place, anchor, candidates)
        else:
            yield _by_distance(place, anchor, candidates)


def _between(anchor: SceneObject, other: SceneObject, candidates: Things) -> _Ordering:
    """Return the ordering for *between the bin and the button*.

    First comes the object over which the way from one anchor to the other is shortest.
    """
    others = [thing for thing in candidates if thing not in (anchor, other)]
    return _Ordering(others, _detour(anchor, other), _WIDE_TOLERANCE)


def _on_side_of(place: Place, anchor: SceneObject, candidates: Things) -> _Ordering:
    """Return the ordering for *to the left of the bin*: all objects there, which tie.

    So any of them may be meant.
    """
    across = _sideways(place)
    aside = []
    for thing in candidates:
        if thing is not anchor and across(thing) < across(anchor):
            aside.append(thing)
    return _Ordering(aside, lambda _thing: 0.0, 0.0)


def _by_distance(place: Place, anchor: SceneObject, candidates: Things) -> _Ordering:
    """Return the ordering for *nearest to the bin*, or for *farthest from the bin* with depth +1.

    Words such as *next to the bin* are vague, so more objects tie.
    """
    others = [thing for thing in candidates if thing is not anchor]
    tolerance = _WIDE_TOLERANCE if place.allows_several else _TOLERANCE
    sign = -1.0 if place.depth > 0 else 1.0
    return _Ordering(others, _distance(anchor.position[:2], sign), tolerance)


def _direction_orderings(place: Place, candidates: Things) -> Iterator[_Ordering]:
    """Yield the orderings along a direction, or from a corner or the middle of the table.

    *closest to you* may mean the depth on the table or the distance from the robot, so there is an
    ordering by each.
    """
    if place.kind == "side":
        across = _sideways(place)
        if place.is_in_picture:
            yield _Ordering(candidates, across, _TANGENT_TOLERANCE, _SIDE_TANGENT)
        else:
            yield _Ordering(candidates, across, _TOLERANCE)
    elif place.kind == "depth":
        # An object far to the side is farther from the robot than its depth says.
        yield _Ordering(candidates, lambda thing: -place.depth * thing.position.x, _TOLERANCE)
        yield _Ordering(candidates, _distance(ROBOT_BASE[:2], -place.depth), _TOLERANCE)
    elif place.kind == "corner":
        yield from _corner_orderings(place, candidates)
    else:
        yield from _middle_orderings(candidates)


def _corner_orderings(place: Place, candidates: Things) -> Iterator[_Ordering]:
    """Yield the orderings for *in the back left corner*: by distance from two corners.

    One is of the table, the other of the area where objects stand; words can mean either.
    """
    end = "back" if place.depth > 0 else "front"
    is_left = (place.side == "left") != place.is_in_picture  # the picture is mirrored
    side = "left" if is_left else "right"
    for area in (_TABLE, _WORK_AREA):
        yield _Ordering(candidates, _distance((area[end], area[side])), _TOLERANCE)


def _middle_orderings(candidates: Things) -> Iterator[_Ordering]:
    """Yield the orderings in which the object *in the middle* is first.

    One is by distance from the center. If the number of objects is odd, another one is by distance
    in y from the middle object of a row: the third of five from left to right.
    """
    center = (_center_x(candidates), 0.0)
    yield _Ordering(candidates, _distance(center), _WIDE_TOLERANCE)
    if len(candidates) % 2 == 1:
        positions_y = sorted(thing.position.y for thing in candidates)
        middle_y = positions_y[len(positions_y) // 2]
        yield _Ordering(candidates, lambda thing: abs(thing.position.y - middle_y), _TOLERANCE)


def _center_x(things: Things) -> float:
    """Return the x that counts as the center, m: halfway between the nearest and the farthest.

    With fewer than two objects it is that of the work area.
    """
    if len(things) < 2:  # noqa: PLR2004
        return _CENTER_X
    positions_x = [thing.position.x for thing in things]
    return (min(positions_x) + max(positions_x)) / 2


def _sideways(place: Place) -> SortKey:
    """Return the key that is smallest for the object farthest to the place's side.

    The object's y, or its place in the picture, is positive on the left; hence the sign.
    """
    sign = -1.0 if place.side == "left" else 1.0
    if place.is_in_picture:
        return lambda thing: sign * _left_in_picture(thing)
    return lambda thing: sign * thing.position.y


def _distance(point: Sequence[float], sign: float = 1.0) -> SortKey:
    """Return the key by distance from a point (x, y); with the sign -1, the farthest is first."""
    return lambda thing: sign * math.dist(thing.position[:2], point)


def _detour(first: SceneObject, second: SceneObject) -> SortKey:
    """Return the key by the length of the way from one object to another over a third one, m."""
    to_first = _distance(first.position[:2])
    to_second = _distance(second.position[:2])
    return lambda thing: to_first(thing) + to_second(thing)


def _left_in_picture(thing: SceneObject) -> float:
    """Return how far to the left an object is in the front camera's picture: 0 in the middle.

    It is the tangent of the horizontal angle between the camera's axis and the object, positive on
    the left. The camera looks towards the robot, so objects at positive y, on the robot's left, are
    on the right of the picture.
    """
    to_x, to_y = thing.position.x - _CAMERA[0], thing.position.y - _CAMERA[1]
    # How far ahead of the camera it is, times the length of `_VIEW`, which cancels out below.
    ahead = to_x * _VIEW[0] + to_y * _VIEW[1] + (_CUBE_HEIGHT - _CAMERA[2]) * _VIEW[2]
    return -thing.position.y * math.hypot(*_VIEW) / ahead
