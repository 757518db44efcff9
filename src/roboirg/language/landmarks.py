"""Landmarks: words for places that single out one object of its kind, by a clear margin.

Left and right are the robot's, or in the frame ``camera`` those in the picture of the front
camera, which faces the robot. Near and far always refer to the robot, which is "you", or "the
robot" in the camera frame, so that one instruction has one point of view.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from enum import IntEnum
from functools import lru_cache, partial
from typing import Literal, NamedTuple

from roboirg.core.episode import ObjectKind, Scene, SceneObject
from roboirg.core.motions import Away

MARGIN = 0.03
"""Meters by which a landmark's object must exceed all others in the compared quantity."""
COLUMN_MARGIN = 6.0
"""The same in columns of the front camera's picture (256 pixels wide)."""

WORK_AREA = {"near": -0.3, "far": 0.2, "left": 0.25, "right": -0.25}
"""World x of the near and far edges, y of the left and right ones, in meters."""
TABLE = {"near": -0.7402, "far": 0.4689, "left": 1.2030, "right": -1.2149}
"""The same for the table top."""


class LandmarkClass(IntEnum):
    """What kind of place a landmark names, in the order of preference."""

    EXTREME = 1
    """Extreme in a direction, or on a side: *farthest to your left*."""
    CORNER = 2
    """*closest to your near left corner*"""
    RANK = 3
    """Second or third in a direction: *second closest to you*."""
    FIXTURE = 4
    """Closest to or farthest from the only button, target or bin: *closest to the button*."""
    OTHER_COLOR = 5
    """Closest to the only cube of a color: *closest to the red cube*."""
    NEXT_TO_NAMED = 6
    """Nearest to an extreme or corner: *nearest to the cube closest to you*."""
    NEXT_TO_RANKED = 7
    """Nearest to a rank: *nearest to the cube second closest to you*."""
    SECOND_FROM_NAMED = 8
    """Second nearest to an extreme or corner: *second nearest to the cube closest to you*."""
    THIRD_FROM_NAMED = 9
    """Third nearest to an extreme or corner: *third nearest to the cube closest to you*."""
    FOURTH_RANK = 10
    """Fourth in a direction: *fourth closest to you*."""
    EXTREME_OF_EXTREMES = 11
    """Of a few, the extreme across: *closest to you among the two farthest to your left*."""
    EXTREME_OF_FIXTURE = 12
    """Of a few around a fixture: *closest to you among the two closest to the button*."""
    RANK_OF_EXTREMES = 13
    """Rank within a few: *second closest to you among the three farthest to your left*."""
    FIXTURE_RANK = 14
    """Second or third from a fixture: *second closest to the button*."""


SIMPLE = LandmarkClass.OTHER_COLOR
"""The last class of simple landmarks, of which any may be said; others only if there is none."""

Frame = Literal["robot", "camera"]
FRAMES: tuple[Frame, ...] = ("robot", "camera")

ORDINALS = {1: "second", 2: "third"}
FOURTH = {3: "fourth"}
SIZES = {2: "two", 3: "three", 4: "four"}
"""Of groups of which a landmark singles out one object."""
FIXTURES: tuple[ObjectKind, ...] = ("button", "target", "bin")
"""Kinds of objects near which others are named, if there is only one."""
PAIRED: tuple[ObjectKind, ...] = ("box", "tape")
"""Kinds of objects that always come in pairs."""


class Landmark(NamedTuple):
    """Words for a place that single out one object of its kind.

    Attributes:
        phrase: words after the noun: "the cube *farthest to your left*".
        kind: class.
        sided: whether the words name left or right, so that the frame matters.
    """

    phrase: str
    kind: LandmarkClass
    sided: bool = False

    @property
    def level(self) -> int:
        """The number of the class, as records and exports have it."""
        return int(self.kind)


class Ranking(NamedTuple):
    """A quantity to rank objects by, largest first; differences count from `margin` on."""

    quantity: Callable[[SceneObject], float]
    margin: float = MARGIN

    @property
    def opposite(self) -> Ranking:
        """The order from the other end."""
        return self._replace(quantity=lambda item: -self.quantity(item))

    def select(self, candidates: Sequence[SceneObject], rank: int) -> SceneObject | None:
        """Return the candidate of a rank (from 0); None unless it is clear by the margin."""
        if rank >= len(candidates):
            return None
        values = [(self.quantity(item), position) for position, item in enumerate(candidates)]
        order = sorted(values, reverse=True)
        value, position = order[rank]
        neighbors = order[max(rank - 1, 0) : rank] + order[rank + 1 :][:1]
        if any(abs(value - other) < self.margin for other, _ in neighbors):
            return None
        return candidates[position]

    def first(self, candidates: Sequence[SceneObject], size: int) -> tuple[SceneObject, ...]:
        """Return the first `size` candidates; none unless the next one is clear by the margin."""
        order = sorted(candidates, key=self.quantity, reverse=True)
        if size >= len(order):
            return ()
        clear = self.quantity(order[size - 1]) - self.quantity(order[size]) >= self.margin
        return tuple(order[:size]) if clear else ()


class Selector(NamedTuple):
    """A landmark and its meaning: the candidate of rank `rank`.

    Ambiguous words select an object only if all their rankings agree on it.
    """

    landmark: Landmark
    rankings: tuple[Ranking, ...]
    candidates: tuple[SceneObject, ...]
    rank: int = 0

    def select(self) -> SceneObject | None:
        """Return the object that the landmark singles out; None if it is unclear."""
        first, *others = (ranking.select(self.candidates, self.rank) for ranking in self.rankings)
        return first if all(other is first for other in others) else None


# Cached: all forms of an episode ask for the same.
@lru_cache(maxsize=64)
def landmarks(
    scene: Scene, thing: ObjectKind, target: SceneObject, frame: Frame = "robot"
) -> tuple[Landmark, ...]:
    """Return the landmarks that single out the target: the simple ones, or else all others."""
    found: list[Landmark] = []
    for selector in selectors(scene, thing, frame):
        if selector.landmark.kind > SIMPLE and found and found[0].kind <= SIMPLE:
            break
        if selector.select() is target:
            found.append(selector.landmark)
    return tuple(found)


def selectors(scene: Scene, thing: ObjectKind, frame: Frame) -> Iterator[Selector]:
    """Yield every selector, from the best class to the last.

    Boxes and tapes stand in pairs, one on each side of the robot; only their sides are used.
    """
    candidates = candidates_in(scene, thing)
    if thing in PAIRED:
        yield from _sides(candidates, frame)
        return
    extremes = tuple(_extremes(candidates, frame))
    named = (*extremes, *_corners(candidates, frame))
    ranked = tuple(_ranks(candidates, frame))
    fixtures = tuple(_fixtures(scene, candidates))
    yield from (*named, *_far_sides(candidates, frame), *ranked, *fixtures)
    yield from _other_colors(candidates)
    yield from _chains(thing, candidates, named, LandmarkClass.NEXT_TO_NAMED)
    yield from _chains(thing, candidates, ranked, LandmarkClass.NEXT_TO_RANKED)
    yield from _chains(thing, candidates, named, LandmarkClass.SECOND_FROM_NAMED, rank=1)
    yield from _chains(thing, candidates, named, LandmarkClass.THIRD_FROM_NAMED, rank=2)
    yield from _ranks(candidates, frame, FOURTH, LandmarkClass.FOURTH_RANK)
    extreme_in, ranks_in = partial(_extremes, frame=frame), partial(_ranks, frame=frame)
    yield from _members(candidates, extremes, extreme_in, LandmarkClass.EXTREME_OF_EXTREMES)
    yield from _members(candidates, fixtures, extreme_in, LandmarkClass.EXTREME_OF_FIXTURE)
    yield from _members(candidates, extremes, ranks_in, LandmarkClass.RANK_OF_EXTREMES)
    yield from _fixture_ranks(candidates, fixtures)


def candidates_in(scene: Scene, thing: ObjectKind) -> tuple[SceneObject, ...]:
    """Return the visible candidates: all objects of a kind, without cubes that arrive later."""
    if thing != "cube":
        return scene.of_kind(thing)
    late = {motion.subject for motion in scene.motions_of(Away) if motion.start == 0}
    return tuple(cube for cube in scene.of_kind("cube") if cube.name not in late)


def things_of_color(scene: Scene, kind: ObjectKind, color: str) -> tuple[SceneObject, ...]:
    """Return the cubes of a color, or the containers over them if `kind` is that of containers."""
    return tuple(
        item if item.inside is None or item.kind == kind else scene[item.inside]
        for item in scene.objects
        if item.color == color
    )


class Direction(NamedTuple):
    """Words and a ranking along one of four directions.

    Attributes:
        extreme: the first in that direction.
        rank: after *second* and *third*.
        ranking: the first one first.
        side: ``left`` or ``right``, for which the frame matters; else empty.
    """

    extreme: str
    rank: str
    ranking: Ranking
    side: str = ""


def directions(frame: Frame) -> tuple[Direction, ...]:
    """Return left, right, near and far of a frame, in this order."""
    if frame == "robot":
        robot, owner = "you", "your"
        left = Ranking(lambda item: item.position.y)
    else:
        robot, owner = "the robot", "the camera's"
        left = Ranking(lambda item: -_column(item), COLUMN_MARGIN)
    far = Ranking(lambda item: item.position.x)
    closest, farthest = f"closest to {robot}", f"farthest from {robot}"
    return (
        Direction(f"farthest to {owner} left", f"from {owner} left", left, "left"),
        Direction(f"farthest to {owner} right", f"from {owner} right", left.opposite, "right"),
        Direction(closest, closest, far.opposite),
        Direction(farthest, farthest, far),
    )


def sideways(frame: Frame) -> tuple[Direction, ...]:
    """Return left and right of a frame."""
    return directions(frame)[:2]


def _column(item: SceneObject) -> float:
    """Return an object's column in the picture of the front camera.

    The camera stands at (0.3, 0, 0.4) and looks at (0, 0, -0.2).
    """
    x, y, z = item.position.x, item.position.y, 0.02
    depth = 0.49194 - 0.44721 * x - 0.89443 * z
    return 128.0 + 128.0 * y / depth


def _extremes(candidates: tuple[SceneObject, ...], frame: Frame) -> Iterator[Selector]:
    for direction in directions(frame):
        landmark = Landmark(direction.extreme, LandmarkClass.EXTREME, bool(direction.side))
        yield Selector(landmark, (direction.ranking,), candidates)


def _sides(candidates: tuple[SceneObject, ...], frame: Frame) -> Iterator[Selector]:
    owner = "your" if frame == "robot" else "the camera's"
    for direction in sideways(frame):
        landmark = Landmark(f"on {owner} {direction.side}", LandmarkClass.EXTREME, sided=True)
        yield Selector(landmark, (direction.ranking,), candidates)


def _far_sides(candidates: tuple[SceneObject, ...], frame: Frame) -> Iterator[Selector]:
    """Yield *at your far right*, where the side and the far corner mean the same object."""
    if frame != "robot":
        return
    for direction in sideways(frame):
        side = direction.side
        corners = [nearness((area["far"], area[side])) for area in (WORK_AREA, TABLE)]
        landmark = Landmark(f"at your far {side}", LandmarkClass.EXTREME, sided=True)
        yield Selector(landmark, (direction.ranking, *corners), candidates)


def _corners(candidates: tuple[SceneObject, ...], frame: Frame) -> Iterator[Selector]:
    # The words can mean the corner of the table, or of the work area.
    for side, mirrored in (("left", "right"), ("right", "left")):
        for depth, reach in (("near", "near"), ("far", "far from")):
            if frame == "robot":
                phrase, y = f"closest to your {depth} {side} corner", side
            else:
                phrase = f"closest to the camera's {side} corner {reach} the robot"
                y = mirrored
            rankings = tuple(nearness((area[depth], area[y])) for area in (WORK_AREA, TABLE))
            yield Selector(Landmark(phrase, LandmarkClass.CORNER, sided=True), rankings, candidates)


def _ranks(
    candidates: tuple[SceneObject, ...],
    frame: Frame,
    ordinals: Mapping[int, str] = ORDINALS,
    kind: LandmarkClass = LandmarkClass.RANK,
) -> Iterator[Selector]:
    for rank, ordinal in ordinals.items():
        # The last one in a row is the extreme of the other end.
        if rank > len(candidates) - 2:
            continue
        for direction in directions(frame):
            landmark = Landmark(f"{ordinal} {direction.rank}", kind, bool(direction.side))
            yield Selector(landmark, (direction.ranking,), candidates, rank)


def fixtures_in(scene: Scene) -> list[SceneObject]:
    """Return the button, the target and the bin, if there is only one of it."""
    of_kinds = [scene.of_kind(kind) for kind in FIXTURES]
    return [of_kind[0] for of_kind in of_kinds if len(of_kind) == 1]


def _fixtures(scene: Scene, candidates: tuple[SceneObject, ...]) -> Iterator[Selector]:
    for fixture in fixtures_in(scene):
        near = nearness(fixture.position)
        for words, ranking in (("closest to", near), ("farthest from", near.opposite)):
            landmark = Landmark(f"{words} the {fixture.kind}", LandmarkClass.FIXTURE)
            yield Selector(landmark, (ranking,), candidates)


def _fixture_ranks(
    candidates: tuple[SceneObject, ...], fixtures: Sequence[Selector]
) -> Iterator[Selector]:
    for rank, ordinal in ORDINALS.items():
        # The last one in a row is the first from the other end.
        if rank > len(candidates) - 2:
            continue
        for selector in fixtures:
            landmark = Landmark(f"{ordinal} {selector.landmark.phrase}", LandmarkClass.FIXTURE_RANK)
            yield selector._replace(landmark=landmark, rank=rank)


def alone_in_color(things: Sequence[SceneObject]) -> list[SceneObject]:
    """Return the things that are the only ones of their color."""
    colors = [thing.color for thing in things]
    return [thing for thing in things if thing.color and colors.count(thing.color) == 1]


def _other_colors(candidates: Sequence[SceneObject]) -> Iterator[Selector]:
    for anchor in alone_in_color(candidates):
        landmark = Landmark(f"closest to the {anchor.color} cube", LandmarkClass.OTHER_COLOR)
        yield Selector(landmark, (nearness(anchor.position),), _without(candidates, anchor))


def _chains(
    thing: str,
    candidates: Sequence[SceneObject],
    anchors: Sequence[Selector],
    kind: LandmarkClass,
    rank: int = 0,
) -> Iterator[Selector]:
    for selector in anchors:
        anchor = selector.select()
        if anchor is None:
            continue
        others = _without(candidates, anchor)
        # The last one in a row is not called "second nearest".
        if rank and rank >= len(others) - 1:
            continue
        nearest = f"{ORDINALS[rank]} nearest" if rank else "nearest"
        phrase = f"{nearest} to the {thing.removeprefix('hidden_')} {selector.landmark.phrase}"
        landmark = Landmark(phrase, kind, selector.landmark.sided)
        yield Selector(landmark, (nearness(anchor.position),), others, rank)


def _members(
    candidates: Sequence[SceneObject],
    groups: Iterable[Selector],
    inner: Callable[[tuple[SceneObject, ...]], Iterator[Selector]],
    kind: LandmarkClass,
) -> Iterator[Selector]:
    """Yield one of two, three or four objects at a place: *closest to you among the two there*.

    The first two, three or four objects of a selector in `groups` are a group; `inner` yields the
    selectors within it.
    """
    for group in groups:
        for size, number in SIZES.items():
            (ranking,) = group.rankings
            members = ranking.first(candidates, size)
            for one in inner(members):
                sided, of_sided = one.landmark.sided, group.landmark.sided
                # Along one line, the words of the group would be superfluous or odd.
                if group.landmark.kind == LandmarkClass.EXTREME and sided == of_sided:
                    continue
                phrase = f"{one.landmark.phrase} among the {number} {group.landmark.phrase}"
                landmark = Landmark(phrase, kind, sided or of_sided)
                yield one._replace(landmark=landmark)


def _without(candidates: Sequence[SceneObject], anchor: SceneObject) -> tuple[SceneObject, ...]:
    return tuple(item for item in candidates if item is not anchor)


def nearness(place: Sequence[float]) -> Ranking:
    """Return the order by the distance from a place, the nearest first."""
    x, y = place[:2]
    return Ranking(lambda item: -math.hypot(item.position.x - x, item.position.y - y))
