"""Places in words: landmarks that pick one object out of its like, by a clear margin.

Left and right are the robot's unless the frame is ``camera``: the front camera looks at the
robot, so it sees them mirrored. Near and far are always told from the robot ("you").
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from typing import Literal, NamedTuple

from roboirg.episode import Scene, SceneObject

MARGIN = 0.03
"""Metres by which a landmark's object must win over any other in the quantity compared."""

Frame = Literal["robot", "camera"]
FRAMES: tuple[Frame, ...] = ("robot", "camera")

ORDINALS = {1: "second", 2: "third"}


class Landmark(NamedTuple):
    """A place that tells one object from all others of its kind.

    Attributes:
        phrase: what follows the noun: "the cube *at the far left*".
        level: class, in the order of preference: 1 extremes, 2 corners, 3 ranks, 4 fixtures,
            5 cubes of another colour, 6 nearest to an object of class 1 or 2, 7 to one of
            class 3, 8 second nearest to one of class 1 or 2.
        sided: whether the words name left or right, so that it matters whose.
    """

    phrase: str
    level: int
    sided: bool = False


class Selector(NamedTuple):
    """A landmark and how it selects: the `rank`-th largest quantity among the candidates."""

    landmark: Landmark
    quantity: Callable[[SceneObject], float]
    candidates: tuple[SceneObject, ...]
    rank: int = 0

    def selected(self) -> SceneObject | None:
        """The object it picks out, or None if it is not clear which."""
        if self.rank >= len(self.candidates):
            return None
        values = [(self.quantity(item), position) for position, item in enumerate(self.candidates)]
        order = sorted(values, reverse=True)
        value, position = order[self.rank]
        neighbours = order[max(self.rank - 1, 0) : self.rank] + order[self.rank + 1 :][:1]
        if any(abs(value - other) < MARGIN for other, _ in neighbours):
            return None
        return self.candidates[position]


def landmarks(
    scene: Scene, thing: Literal["cube", "container"], target: SceneObject, frame: Frame = "robot"
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


def selectors(
    scene: Scene, thing: Literal["cube", "container"], frame: Frame
) -> Iterator[Selector]:
    """Every selector, from the best class to the last."""
    candidates = scene.of_kind(thing)
    named = (*_extremes(candidates, frame), *_corners(candidates, frame))
    ranked = tuple(_ranks(candidates, frame))
    yield from (*named, *ranked)
    yield from _fixtures(scene, candidates)
    yield from _other_colours(candidates)
    yield from _chains(thing, candidates, named, level=6)
    yield from _chains(thing, candidates, ranked, level=7)
    yield from _chains(thing, candidates, named, level=8, rank=1)


class _Direction(NamedTuple):
    extreme: str
    rank: str | None
    quantity: Callable[[SceneObject], float]
    sided: bool


def _directions(frame: Frame) -> tuple[_Direction, ...]:
    left, right = ("left", "right") if frame == "robot" else ("right", "left")
    return (
        _Direction(f"at the far {left}", f"from the {left}", lambda item: item.position.y, True),
        _Direction(f"at the far {right}", f"from the {right}", lambda item: -item.position.y, True),
        _Direction("closest to you", "closest to you", lambda item: -item.position.x, False),
        _Direction("farthest from you", "farthest from you", lambda item: item.position.x, False),
    )


def _extremes(candidates: tuple[SceneObject, ...], frame: Frame) -> Iterator[Selector]:
    for way in _directions(frame):
        yield Selector(Landmark(way.extreme, 1, way.sided), way.quantity, candidates)


def _corners(candidates: tuple[SceneObject, ...], frame: Frame) -> Iterator[Selector]:
    # How far an object lies towards a corner is measured along the diagonal: no listener needs
    # to know where the work area ends.
    for side, y in (("left", 1.0), ("right", -1.0)):
        for depth, x in (("near", -1.0), ("far", 1.0)):
            sign = y if frame == "robot" else -y
            # A corner that is near the robot is far from the camera: then say near to whom.
            phrase = f"closest to the {depth} {side} corner"
            if frame == "camera":
                reach = "close to" if depth == "near" else "far from"
                phrase = f"closest to the {side} corner {reach} you"
            landmark = Landmark(phrase, 2, sided=True)
            yield Selector(landmark, _diagonal(x, sign), candidates)


def _diagonal(x: float, y: float) -> Callable[[SceneObject], float]:
    return lambda item: (x * item.position.x + y * item.position.y) / math.sqrt(2.0)


def _ranks(candidates: tuple[SceneObject, ...], frame: Frame) -> Iterator[Selector]:
    for rank, ordinal in ORDINALS.items():
        # The last of a row is an extreme of the other end.
        if rank > len(candidates) - 2:
            continue
        for way in _directions(frame):
            landmark = Landmark(f"{ordinal} {way.rank}", 3, way.sided)
            yield Selector(landmark, way.quantity, candidates, rank)


def _fixtures(scene: Scene, candidates: tuple[SceneObject, ...]) -> Iterator[Selector]:
    for kind in ("button", "target"):
        fixtures = [item for item in scene.objects if item.kind == kind]
        if len(fixtures) != 1:
            continue
        away = _distance(fixtures[0])
        near = Landmark(f"closest to the {kind}", 4)
        yield Selector(near, _negated(away), candidates)
        yield Selector(Landmark(f"farthest from the {kind}", 4), away, candidates)


def _other_colours(candidates: Sequence[SceneObject]) -> Iterator[Selector]:
    for anchor in candidates:
        like = [item for item in candidates if item.colour == anchor.colour]
        if anchor.colour is None or len(like) != 1:
            continue
        landmark = Landmark(f"closest to the {anchor.colour} cube", 5)
        yield Selector(landmark, _negated(_distance(anchor)), _without(candidates, anchor))


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
        nearness = f"{ORDINALS[rank]} nearest" if rank else "nearest"
        phrase = f"{nearness} to the {thing} {selector.landmark.phrase}"
        landmark = Landmark(phrase, level, selector.landmark.sided)
        yield Selector(landmark, _negated(_distance(anchor)), others, rank)


def _without(candidates: Sequence[SceneObject], anchor: SceneObject) -> tuple[SceneObject, ...]:
    return tuple(item for item in candidates if item is not anchor)


def _distance(anchor: SceneObject) -> Callable[[SceneObject], float]:
    x, y, _ = anchor.position
    return lambda item: math.hypot(item.position.x - x, item.position.y - y)


def _negated(quantity: Callable[[SceneObject], float]) -> Callable[[SceneObject], float]:
    return lambda item: -quantity(item)
