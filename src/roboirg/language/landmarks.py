"""Landmarks: words for places that single out one object of its kind, by a clear margin.

Left and right are the robot's, or in the frame ``camera`` those in the picture of the front
camera, which faces the robot. Near and far always refer to the robot, which is "you", or "the
robot" in the camera frame, so that one instruction has one point of view.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from typing import Literal, NamedTuple

from roboirg.core.episode import ObjectKind, Scene, SceneObject
from roboirg.core.motions import Away

MARGIN = 0.03
"""Meters by which a landmark's object must exceed all others in the compared quantity."""
COLUMN_MARGIN = 6.0
"""The same in columns of the front camera's picture, 256 pixels wide. What words mean does not
depend on how many pixels observations have."""

_PICTURE_MIDDLE = 128.0
"""Column of the front camera's axis, and as many columns for a tangent of 1 from there."""
_AXIS_X = 0.44721
_AXIS_Z = 0.89443
"""Parts of the camera's axis along x and z, without minus signs: it looks down and to the robot."""
_ORIGIN_DEPTH = 0.49194
"""Meters from the camera to the origin, along its axis."""
_CUBE_HEIGHT = 0.02

WORK_AREA = {"near": -0.3, "far": 0.2, "left": 0.25, "right": -0.25}
"""Edges of the area where things stand, in meters: world x of the near and far ones, else y."""
TABLE = {"near": -0.7402, "far": 0.4689, "left": 1.2030, "right": -1.2149}
"""The same edges of the table top."""


Frame = Literal["robot", "camera"]
FRAMES: tuple[Frame, ...] = ("robot", "camera")

ORDINALS = {1: "second", 2: "third"}
"""Words for the ranks of a landmark; ranks count from 0."""
FOURTH = {3: "fourth"}
"""One more rank, which people hardly name."""
FIXTURES: tuple[ObjectKind, ...] = ("button", "target", "bin")
"""Kinds of objects near which others are named, if there is only one."""
PAIRED: tuple[ObjectKind, ...] = ("box", "tape")
"""Kinds of objects that always come in pairs."""


class Ranking(NamedTuple):
    """An order of objects by a quantity, the largest first.

    By ``y``, the leftmost object comes first, since y points to the robot's left.

    Attributes:
        quantity: of an object; meters, or columns of the camera's picture.
        margin: a difference of the quantity counts from here on, in its unit.
    """

    quantity: Callable[[SceneObject], float]
    margin: float = MARGIN

    @property
    def opposite(self) -> Ranking:
        """The order from the other end: the smallest quantity first."""
        return self._replace(quantity=lambda item: -self.quantity(item))

    def select(self, candidates: Sequence[SceneObject], rank: int) -> SceneObject | None:
        """Return the object of a rank, 0 for the largest quantity; None if that is unclear.

        It is clear if its quantity differs by at least the margin from those just before and after
        it. None also if there are too few objects.

        Args:
            candidates: the objects, in any order.
            rank: 0 for the first, 1 for the second.
        """
        if rank >= len(candidates):
            return None
        ordered = sorted(candidates, key=self.quantity, reverse=True)
        chosen = ordered[rank]
        # The one before it, if it is not the first, and the one after it, if it is not the last.
        neighbors = [*ordered[max(rank - 1, 0) : rank], *ordered[rank + 1 : rank + 2]]
        for neighbor in neighbors:
            if abs(self.quantity(chosen) - self.quantity(neighbor)) < self.margin:
                return None
        return chosen


class Selector(NamedTuple):
    """A landmark, words for a place, and its meaning: which of some objects it singles out.

    Attributes:
        phrase: the words after the noun: "the cube *second from your left*".
        rankings: the orders that the words can mean; they single out an object only if all agree.
        candidates: the objects that are compared.
        rank: which of the order is meant, from 0.
        is_in_depth: whether the words order objects from near to far, *closest to you*: by depth,
            and perhaps not by distance.
    """

    phrase: str
    rankings: tuple[Ranking, ...]
    candidates: tuple[SceneObject, ...]
    rank: int = 0
    is_in_depth: bool = False

    def select(self) -> SceneObject | None:
        """Return the object that the landmark singles out; None if it is unclear."""
        return agreed(ranking.select(self.candidates, self.rank) for ranking in self.rankings)


def agreed(found: Iterable[SceneObject | None]) -> SceneObject | None:
    """Return the object that all readings of some words lead to; None if they differ.

    Args:
        found: the object that each reading leads to, None if it is unclear; at least one.
    """
    first, *others = found
    for other in others:
        if other is not first:
            return None
    return first


def selectors(scene: Scene, kind: ObjectKind, frame: Frame) -> Iterator[Selector]:
    """Yield phrases for where an object stands, each with the rule by which it singles one out.

    *closest to you*, *second from your left*, *closest to the button*, *nearest to the cube closest
    to you*. A rule ranks the objects of the kind, for example from left to right. Simpler words
    come first, and this order must stay: words of texts are drawn from it.

    Args:
        scene: with the objects.
        kind: of the objects. Boxes and tapes stand in pairs, one on each side of the robot; only
            their sides are used, *on your left*.
        frame: whose left and right is meant.
    """
    candidates = candidates_in(scene, kind)
    if kind in PAIRED:
        yield from _sides(candidates, frame)
        return
    ends = [*_extremes(candidates, frame), *_corners(candidates, frame)]
    ranked = list(_in_rows(candidates, frame))
    yield from ends
    yield from _far_sides(candidates, frame)
    yield from ranked
    yield from _by_fixtures(scene, candidates)
    yield from _by_colors(candidates)
    yield from _by_neighbors(kind, candidates, ends)
    yield from _by_neighbors(kind, candidates, ranked)
    yield from _by_neighbors(kind, candidates, ends, rank=1)
    yield from _by_neighbors(kind, candidates, ends, rank=2)
    yield from _in_rows(candidates, frame, FOURTH)


def candidates_in(scene: Scene, kind: ObjectKind) -> tuple[SceneObject, ...]:
    """Return the objects of a kind that stand in the scene from the start.

    Cubes that are away at the start and arrive later are left out.
    """
    if kind != "cube":
        return scene.of_kind(kind)
    arriving_later = {motion.subject for motion in scene.motions_of(Away) if motion.start == 0}
    return tuple(cube for cube in scene.of_kind("cube") if cube.name not in arriving_later)


def things_of_color(scene: Scene, kind: ObjectKind, color: str) -> tuple[SceneObject, ...]:
    """Return the things to handle for a color: open ones, or the containers over hidden ones.

    For ``red``: the red cube, or the container over it. A hidden cube stands for itself if `kind`
    is the kind of hidden cubes.
    """
    found = []
    for item in scene.objects:
        if item.color != color:
            continue
        if item.inside is None or item.kind == kind:
            found.append(item)
        else:
            found.append(scene[item.inside])
    return tuple(found)


class Direction(NamedTuple):
    """Words and a ranking along one of four directions.

    Attributes:
        extreme: words for the first in that direction: "the cube *closest to you*".
        rank: words after *second* and *third*: "second *from your left*".
        ranking: the order of objects, the farthest in that direction first.
        side: ``left`` or ``right``, for which the frame matters; else empty.
    """

    extreme: str
    rank: str
    ranking: Ranking
    side: str = ""


def directions(frame: Frame) -> tuple[Direction, ...]:
    """Return the words and the order of things for left, right, near and far, in this sequence.

    In the frame ``robot``, left and right are the robot's, by y in meters; in ``camera``, they are
    those of the front camera's picture, by its columns.
    """
    if frame == "robot":
        robot = "you"
        whose = "your"
        left = Ranking(lambda item: item.position.y)
    else:
        robot = "the robot"
        whose = "the camera's"
        left = Ranking(lambda item: -_column(item), COLUMN_MARGIN)
    far = Ranking(lambda item: item.position.x)
    closest = f"closest to {robot}"
    farthest = f"farthest from {robot}"
    return (
        Direction(f"farthest to {whose} left", f"from {whose} left", left, "left"),
        Direction(f"farthest to {whose} right", f"from {whose} right", left.opposite, "right"),
        Direction(closest, closest, far.opposite),
        Direction(farthest, farthest, far),
    )


def sideways(frame: Frame) -> tuple[Direction, ...]:
    """Return the words and the order of things for left and right, in this sequence."""
    return directions(frame)[:2]


def _column(item: SceneObject) -> float:
    """Return an object's column in the picture of the front camera, from 0, its left, to 256.

    The camera stands at (0.3, 0, 0.4) and looks at (0, 0, -0.2), meters in the world; all heights
    count as a cube's. A perspective projection: the column is off the middle by y through the
    depth, the distance along the camera's axis, in units of half a picture.
    """
    depth = _ORIGIN_DEPTH - _AXIS_X * item.position.x - _AXIS_Z * _CUBE_HEIGHT
    return _PICTURE_MIDDLE + _PICTURE_MIDDLE * item.position.y / depth


def _extremes(candidates: tuple[SceneObject, ...], frame: Frame) -> Iterator[Selector]:
    """Yield the words for the first thing in each of the four directions: *closest to you*."""
    for direction in directions(frame):
        is_in_depth = not direction.side
        ranking = (direction.ranking,)
        yield Selector(direction.extreme, ranking, candidates, is_in_depth=is_in_depth)


def _sides(candidates: tuple[SceneObject, ...], frame: Frame) -> Iterator[Selector]:
    """Yield the words for the two things of a pair by their sides: *on your left*."""
    owner = "your" if frame == "robot" else "the camera's"
    for direction in sideways(frame):
        yield Selector(f"on {owner} {direction.side}", (direction.ranking,), candidates)


def corner_rankings(depth: str, side: str) -> tuple[Ranking, ...]:
    """Return the orders by the distance from a corner, the nearest first.

    There are two, since people may mean the corner of the area where things stand, or that of the
    table.

    Args:
        depth: ``near`` or ``far`` from the robot.
        side: ``left`` or ``right`` of the robot.
    """
    return tuple(nearness((area[depth], area[side])) for area in (WORK_AREA, TABLE))


def _far_sides(candidates: tuple[SceneObject, ...], frame: Frame) -> Iterator[Selector]:
    """Yield *at your far left* and *at your far right*, only in the robot's frame.

    People may mean the first thing from that side or the one nearest to the far corner, so a thing
    counts only if it is both.
    """
    if frame != "robot":
        return
    for direction in sideways(frame):
        phrase = f"at your far {direction.side}"
        corners = corner_rankings("far", direction.side)
        yield Selector(phrase, (direction.ranking, *corners), candidates)


def _corners(candidates: tuple[SceneObject, ...], frame: Frame) -> Iterator[Selector]:
    """Yield the words for the thing nearest to each corner: *closest to your near left corner*.

    The camera faces the robot, so what is left in its picture is on the robot's right
    (`robot_side`).
    """
    depth_words = {"near": "near", "far": "far from"}
    for side, robot_side in (("left", "right"), ("right", "left")):
        for depth, depth_word in depth_words.items():
            if frame == "robot":
                phrase = f"closest to your {depth} {side} corner"
                rankings = corner_rankings(depth, side)
            else:
                phrase = f"closest to the camera's {side} corner {depth_word} the robot"
                rankings = corner_rankings(depth, robot_side)
            yield Selector(phrase, rankings, candidates)


def _in_rows(
    candidates: tuple[SceneObject, ...],
    frame: Frame,
    ordinals: Mapping[int, str] = ORDINALS,
) -> Iterator[Selector]:
    """Yield the words for things in a row, counted from an end: *second from your left*.

    The last thing in a row gets none, since it is the first from the other end.

    Args:
        candidates: the things.
        frame: whose left and right is meant.
        ordinals: the words by rank, from 0: 1 is *second*.
    """
    for rank, ordinal in ordinals.items():
        # The last one in a row is the extreme of the other end.
        if rank > len(candidates) - 2:
            continue
        for direction in directions(frame):
            phrase = f"{ordinal} {direction.rank}"
            # *Fourth closest* is not counted as depth: `places` would leave it out.
            is_in_depth = not direction.side and rank not in FOURTH
            yield Selector(phrase, (direction.ranking,), candidates, rank, is_in_depth)


def fixtures_in(scene: Scene) -> list[SceneObject]:
    """Return those of button, target and bin of which there is exactly one."""
    of_kinds = [scene.of_kind(kind) for kind in FIXTURES]
    return [of_kind[0] for of_kind in of_kinds if len(of_kind) == 1]


def _by_fixtures(scene: Scene, candidates: tuple[SceneObject, ...]) -> Iterator[Selector]:
    """Yield words for the things nearest to a fixture and farthest from it, *the button*.

    Fixtures are button, target and bin.
    """
    for fixture in fixtures_in(scene):
        near = nearness(fixture.position)
        yield Selector(f"closest to the {fixture.kind}", (near,), candidates)
        yield Selector(f"farthest from the {fixture.kind}", (near.opposite,), candidates)


def alone_in_color(things: Sequence[SceneObject]) -> list[SceneObject]:
    """Return the things that are the only ones of their color; things without a color are none."""
    colors = [thing.color for thing in things]
    return [thing for thing in things if thing.color and colors.count(thing.color) == 1]


def _by_colors(candidates: Sequence[SceneObject]) -> Iterator[Selector]:
    """Yield words for the thing nearest to the only cube of a color, *the red cube*."""
    for anchor in alone_in_color(candidates):
        phrase = f"closest to the {anchor.color} cube"
        yield Selector(phrase, (nearness(anchor.position),), _without(candidates, anchor))


def _by_neighbors(
    kind: str,
    candidates: Sequence[SceneObject],
    anchors: Sequence[Selector],
    rank: int = 0,
) -> Iterator[Selector]:
    """Yield words by a neighbor that has words of its own: *nearest to the cube closest to you*.

    The neighbor, or anchor, is what another landmark singles out.

    Args:
        kind: of the candidates.
        candidates: among which the nearest is looked for.
        anchors: the other landmarks.
        rank: 0 for the nearest; 1 and 2 for *second nearest* and *third nearest*.
    """
    nearest = "nearest"
    if rank:
        nearest = f"{ORDINALS[rank]} nearest"
    noun = kind.removeprefix("hidden_")
    for selector in anchors:
        anchor = selector.select()
        if anchor is None:
            continue
        others = _without(candidates, anchor)
        # The last one in a row is not called "second nearest".
        if rank and rank >= len(others) - 1:
            continue
        phrase = f"{nearest} to the {noun} {selector.phrase}"
        yield Selector(phrase, (nearness(anchor.position),), others, rank)


def _without(candidates: Sequence[SceneObject], anchor: SceneObject) -> tuple[SceneObject, ...]:
    """Return the objects but one."""
    return tuple(item for item in candidates if item is not anchor)


def nearness(place: Sequence[float]) -> Ranking:
    """Return the order of objects by the distance from a place in the plane, the nearest first.

    The quantity is the distance in meters with a minus sign, so that the nearest has the largest.
    `place` is x and y in the world; further numbers are ignored.
    """
    x, y = place[:2]
    return Ranking(lambda item: -math.hypot(item.position.x - x, item.position.y - y))
