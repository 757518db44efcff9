"""Places in words: landmarks that pick one object out of its like, by a clear margin.

Left and right are the robot's unless the frame is ``camera``: then they are those of the picture
of the front camera, which looks at the robot. Near and far are always told from the robot: "you",
or "the robot" in the camera frame, so that one instruction has one point of view.
"""

from __future__ import annotations

import functools
import math
from collections.abc import Callable, Iterator, Sequence
from typing import Literal, NamedTuple

from roboirg.core.episode import Scene, SceneObject
from roboirg.core.motions import Away
from roboirg.tasks.task import Thing

MARGIN = 0.03
"""Meters by which a landmark's object must win over any other in the quantity compared."""
COLUMN_MARGIN = 6.0
"""The same in columns of the front camera's picture (256 pixels wide)."""

WORK_AREA = {"near": -0.3, "far": 0.2, "left": 0.25, "right": -0.25}
"""World x of its near and far edge, y of its left and right one."""
TABLE = {"near": -0.7402, "far": 0.4689, "left": 1.2030, "right": -1.2149}
"""The same of the table's top."""

Frame = Literal["robot", "camera"]
FRAMES: tuple[Frame, ...] = ("robot", "camera")

ORDINALS = {1: "second", 2: "third"}
PAIRED: tuple[Thing, ...] = ("box", "tape")
"""Things of which there are always two."""


class Landmark(NamedTuple):
    """A place that tells one object from all others of its kind.

    Attributes:
        phrase: what follows the noun: "the cube *at the far left*".
        level: class, in the order of preference: 1 extremes and the sides of a pair, 2 corners,
            3 ranks, 4 fixtures, 5 cubes of another color, 6 nearest to an object of class 1 or 2,
            7 to one of class 3, 8 second nearest to one of class 1 or 2, 9 third nearest to one of
            those.
        sided: whether the words name left or right, so that it matters whose.
    """

    phrase: str
    level: int
    sided: bool = False


class Reading(NamedTuple):
    """A way to compare: large quantities first, clear from `margin` on."""

    quantity: Callable[[SceneObject], float]
    margin: float = MARGIN

    def selected(self, candidates: Sequence[SceneObject], rank: int) -> SceneObject | None:
        """The candidate of that rank (from 0), or None if it is not clear which."""
        if rank >= len(candidates):
            return None
        values = [(self.quantity(item), position) for position, item in enumerate(candidates)]
        order = sorted(values, reverse=True)
        value, position = order[rank]
        neighbors = order[max(rank - 1, 0) : rank] + order[rank + 1 :][:1]
        if any(abs(value - other) < self.margin for other, _ in neighbors):
            return None
        return candidates[position]


class Selector(NamedTuple):
    """A landmark and how it selects: the `rank`-th of the candidates.

    Words that can be read in several ways select only what all readings agree on.
    """

    landmark: Landmark
    readings: tuple[Reading, ...]
    candidates: tuple[SceneObject, ...]
    rank: int = 0

    def selected(self) -> SceneObject | None:
        """The object it picks out, or None if it is not clear which."""
        first, *others = (reading.selected(self.candidates, self.rank) for reading in self.readings)
        return first if all(other is first for other in others) else None


# Kept, because the forms of an episode ask the same.
@functools.lru_cache(maxsize=64)
def landmarks(
    scene: Scene, thing: Thing, target: SceneObject, frame: Frame = "robot"
) -> tuple[Landmark, ...]:
    """The landmarks of the best available class that tell the target; empty if none does.

    Args:
        scene: everything on the table.
        thing: the kind of the candidates.
        target: one of the candidates.
        frame: whose left and right.
    """
    found: list[Landmark] = []
    for selector in selectors(scene, thing, frame):
        if found and selector.landmark.level > found[0].level:
            break
        if selector.selected() is target:
            found.append(selector.landmark)
    return tuple(found)


def selectors(scene: Scene, thing: Thing, frame: Frame) -> Iterator[Selector]:
    """Every selector, from the best class to the last.

    Boxes and tapes stand in pairs, one on either side of the robot, and are told by their side.
    """
    candidates = seen(scene, thing)
    if thing in PAIRED:
        yield from _sides(candidates, frame)
        return
    named = (*_extremes(candidates, frame), *_corners(candidates, frame))
    ranked = tuple(_ranks(candidates, frame))
    yield from (*named, *ranked)
    yield from _fixtures(scene, candidates)
    yield from _other_colors(candidates)
    yield from _chains(thing, candidates, named, level=6)
    yield from _chains(thing, candidates, ranked, level=7)
    yield from _chains(thing, candidates, named, level=8, rank=1)
    yield from _chains(thing, candidates, named, level=9, rank=2)


def seen(scene: Scene, thing: Thing) -> tuple[SceneObject, ...]:
    """What a listener can check: the cubes that are there at first, or all things of a kind."""
    if thing != "cube":
        return scene.of_kind(thing)
    late = {
        motion.subject for motion in scene.motions if isinstance(motion, Away) and motion.start == 0
    }
    return tuple(cube for cube in scene.of_kind("cube") if cube.name not in late)


class _Direction(NamedTuple):
    extreme: str
    rank: str
    reading: Reading
    sided: bool = False


def _directions(frame: Frame) -> tuple[_Direction, ...]:
    if frame == "robot":
        robot = "you"
        left = Reading(lambda item: item.position.y)
    else:
        robot = "the robot"
        left = Reading(lambda item: -_column(item), COLUMN_MARGIN)
    right = Reading(_negated(left.quantity), left.margin)
    near, far = f"closest to {robot}", f"farthest from {robot}"
    return (
        _Direction("at the far left", "from the left", left, sided=True),
        _Direction("at the far right", "from the right", right, sided=True),
        _Direction(near, near, Reading(lambda item: -item.position.x)),
        _Direction(far, far, Reading(lambda item: item.position.x)),
    )


def _column(item: SceneObject) -> float:
    """Where the front camera sees an object: it stands at (0.3, 0, 0.4), looks at (0, 0, -0.2)."""
    x, y, z = item.position.x, item.position.y, 0.02
    depth = 0.49194 - 0.44721 * x - 0.89443 * z
    return 128.0 + 128.0 * y / depth


def _extremes(candidates: tuple[SceneObject, ...], frame: Frame) -> Iterator[Selector]:
    for way in _directions(frame):
        yield Selector(Landmark(way.extreme, 1, way.sided), (way.reading,), candidates)


def _sides(candidates: tuple[SceneObject, ...], frame: Frame) -> Iterator[Selector]:
    left, right = (way.reading for way in _directions(frame) if way.sided)
    for side, reading in (("left", left), ("right", right)):
        yield Selector(Landmark(f"on the {side}", 1, sided=True), (reading,), candidates)


def _corners(candidates: tuple[SceneObject, ...], frame: Frame) -> Iterator[Selector]:
    # The words leave open which corner is meant: of the table, or of the part that is in use.
    for side, mirrored in (("left", "right"), ("right", "left")):
        for depth, reach in (("near", "near"), ("far", "far from")):
            if frame == "robot":
                phrase, y = f"closest to the {depth} {side} corner of the table", side
            else:
                phrase = f"closest to the {side} corner of the table that is {reach} the robot"
                y = mirrored
            corners = [(area[depth], area[y]) for area in (WORK_AREA, TABLE)]
            readings = tuple(_nearness(corner) for corner in corners)
            yield Selector(Landmark(phrase, 2, sided=True), readings, candidates)


def _ranks(candidates: tuple[SceneObject, ...], frame: Frame) -> Iterator[Selector]:
    for rank, ordinal in ORDINALS.items():
        # The last of a row is an extreme of the other end.
        if rank > len(candidates) - 2:
            continue
        for way in _directions(frame):
            landmark = Landmark(f"{ordinal} {way.rank}", 3, way.sided)
            yield Selector(landmark, (way.reading,), candidates, rank)


def _fixtures(scene: Scene, candidates: tuple[SceneObject, ...]) -> Iterator[Selector]:
    for kind in ("button", "target", "bin"):
        fixtures = [item for item in scene.objects if item.kind == kind]
        if len(fixtures) != 1:
            continue
        away = _distance(fixtures[0].position)
        near = Landmark(f"closest to the {kind}", 4)
        yield Selector(near, (Reading(_negated(away)),), candidates)
        yield Selector(Landmark(f"farthest from the {kind}", 4), (Reading(away),), candidates)


def _other_colors(candidates: Sequence[SceneObject]) -> Iterator[Selector]:
    for anchor in candidates:
        like = [item for item in candidates if item.color == anchor.color]
        if anchor.color is None or len(like) != 1:
            continue
        landmark = Landmark(f"closest to the {anchor.color} cube", 5)
        yield Selector(landmark, (_nearness(anchor.position),), _without(candidates, anchor))


def _chains(
    thing: str,
    candidates: Sequence[SceneObject],
    anchors: Sequence[Selector],
    level: int,
    rank: int = 0,
) -> Iterator[Selector]:
    for selector in anchors:
        anchor = selector.selected()
        if anchor is None:
            continue
        others = _without(candidates, anchor)
        # The last of a row is not "second nearest" to anybody.
        if rank and rank >= len(others) - 1:
            continue
        nearest = f"{ORDINALS[rank]} nearest" if rank else "nearest"
        phrase = f"{nearest} to the {thing} {selector.landmark.phrase}"
        landmark = Landmark(phrase, level, selector.landmark.sided)
        yield Selector(landmark, (_nearness(anchor.position),), others, rank)


def _without(candidates: Sequence[SceneObject], anchor: SceneObject) -> tuple[SceneObject, ...]:
    return tuple(item for item in candidates if item is not anchor)


def _nearness(place: Sequence[float]) -> Reading:
    return Reading(_negated(_distance(place)))


def _distance(place: Sequence[float]) -> Callable[[SceneObject], float]:
    x, y = place[:2]
    return lambda item: math.hypot(item.position.x - x, item.position.y - y)


def _negated(quantity: Callable[[SceneObject], float]) -> Callable[[SceneObject], float]:
    return lambda item: -quantity(item)
