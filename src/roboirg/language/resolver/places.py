"""Places: reading the words for one, and finding what stands there.

A place compares all things of one kind: it orders them along a direction or by their distance
from something, and means the first, second, ... of that order.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Literal

from roboirg.episode import Scene, SceneObject
from roboirg.language.resolver.tokens import Sentence, ordinal_of

Side = Literal["left", "right"]
_SIDES: dict[str, Side] = {"left": "left", "right": "right"}
_MOST: dict[str, Side] = {"leftmost": "left", "rightmost": "right"}
_NEAR = frozenset({"near", "close", "closest", "nearest", "front"})
_FAR = frozenset({"far", "farthest", "furthest", "away", "back"})
_LEAST = frozenset({"closest", "nearest"})
_UTMOST = frozenset({"farthest", "furthest"})
_LISTENER = frozenset({"you", "robot", "yourself"})
_FILLERS = frozenset({"the", "to", "from", "a", "on", "at"})
_COLOURS = frozenset({"red", "green", "blue"})

_MAX_DEPTH = 4
"""Places told by places told by ...: further down nobody follows."""


@dataclass(frozen=True, slots=True)
class Towards:
    """Along a direction of the table: the sum of a side and a depth.

    Attributes:
        side: to that side of the listener, or None.
        depth: +1 away from the robot, -1 towards it, 0 neither.
        rank: 1 for the utmost one.
    """

    side: Side | None
    depth: int
    rank: int = 1


@dataclass(frozen=True, slots=True)
class Beside:
    """By distance from something.

    Attributes:
        anchor: a fixture's kind, a colour, or a place of its own.
        kind: kind of the things that the anchor is one of, for a place.
        nearest: whether small distances come first.
        rank: 1 for the utmost one.
    """

    anchor: str | Place
    kind: str
    nearest: bool
    rank: int = 1


Place = Towards | Beside


def read_places(words: Sentence) -> tuple[Place, ...]:
    """Every place that a sentence names, in order."""
    found: list[Place] = []
    at = 0
    while at < len(words):
        read = _read(words, at)
        if read is None:
            at += 1
        else:
            place, at = read
            found.append(place)
    return tuple(found)


def _read(words: Sentence, at: int, depth: int = 0) -> tuple[Place, int] | None:
    """The place whose words begin exactly here, and where they end."""
    word = _word(words, at)
    rank = ordinal_of(word)
    if rank is not None:
        return _read_from(words, at + 1, rank) or _read_relative(words, at + 1, rank, depth)
    if word in _MOST:
        return Towards(_MOST[word], 0), at + 1
    return (
        _read_corner(words, at) or _read_extreme(words, at) or _read_relative(words, at, 1, depth)
    )


def _read_extreme(words: Sentence, at: int) -> tuple[Place, int] | None:
    """``far left``, ``furthest to the right``."""
    if _word(words, at) not in _FAR:
        return None
    after = _skip(words, at + 1)
    side = _SIDES.get(_word(words, after))
    return None if side is None else (Towards(side, 0), after + 1)


def _read_corner(words: Sentence, at: int) -> tuple[Place, int] | None:
    """``near left corner``, ``left corner far from you``, whatever leads up to it."""
    start = at
    if _word(words, at) in _LEAST:
        start = _skip(words, at + 1)
    word = _word(words, start)
    if word in _SIDES and _word(words, start + 1) == "corner":
        depth = _depth(_word(words, start + 2))
        listener = _skip(words, start + 3)
        if depth and _word(words, listener) in _LISTENER:
            return Towards(_SIDES[word], depth), listener + 1
    side, depth = _SIDES.get(_word(words, start + 1)), _depth(word)
    if side is not None and depth and _word(words, start + 2) == "corner":
        return Towards(side, depth), start + 3
    return None


def _read_from(words: Sentence, at: int, rank: int) -> tuple[Place, int] | None:
    """``(second) from the left``."""
    if _word(words, at) != "from":
        return None
    after = _skip(words, at)
    word = _word(words, after)
    if word in _SIDES:
        return Towards(_SIDES[word], 0, rank), after + 1
    if word in ("front", "back"):
        return Towards(None, -1 if word == "front" else 1, rank), after + 1
    return None


def _read_relative(words: Sentence, at: int, rank: int, depth: int) -> tuple[Place, int] | None:
    """``closest to you``, ``farthest from the button``, ``nearest to the cube at the far left``."""
    word = _word(words, at)
    if word not in _LEAST and word not in _UTMOST:
        return None
    nearest = word in _LEAST
    after = _skip(words, at + 1)
    noun, following = _word(words, after), _word(words, after + 1)
    if noun in _LISTENER:
        return Towards(None, -1 if nearest else 1, rank), after + 1
    if noun in ("button", "target"):
        return Beside(noun, noun, nearest, rank), after + 1
    if noun in _COLOURS and following == "cube":
        return Beside(noun, "cube", nearest, rank), after + 2
    if noun in ("cube", "container") and depth < _MAX_DEPTH:
        inner = _read(words, _skip(words, after + 1), depth + 1)
        if inner is not None:
            return Beside(inner[0], noun, nearest, rank), inner[1]
    return None


def _word(words: Sentence, at: int) -> str:
    return words[at] if at < len(words) else ""


def _skip(words: Sentence, at: int) -> int:
    while _word(words, at) in _FILLERS:
        at += 1
    return at


def _depth(word: str) -> int:
    return -1 if word in _NEAR else 1 if word in _FAR else 0


def find(place: Place, scene: Scene, kind: str, *, mirrored: bool) -> SceneObject | None:
    """What stands at a place, among the things of one kind.

    Args:
        place: where.
        scene: everything on the table.
        kind: of the things that are compared.
        mirrored: whether left and right are those of somebody who faces the robot.
    """
    candidates = [item for item in scene.objects if item.kind == kind]
    if isinstance(place, Beside):
        anchor = _anchor(place, scene, mirrored=mirrored)
        if anchor is None:
            return None
        sign = 1.0 if place.nearest else -1.0
        candidates = [item for item in candidates if item is not anchor]
        candidates.sort(key=lambda item: sign * math.dist(item.position[:2], anchor.position[:2]))
    else:
        y = {"left": 1.0, "right": -1.0, None: 0.0}[place.side] * (-1.0 if mirrored else 1.0)
        x = float(place.depth)
        candidates.sort(key=lambda item: -(x * item.position.x + y * item.position.y))
    return candidates[place.rank - 1] if place.rank <= len(candidates) else None


def _anchor(place: Beside, scene: Scene, *, mirrored: bool) -> SceneObject | None:
    if not isinstance(place.anchor, str):
        return find(place.anchor, scene, place.kind, mirrored=mirrored)
    like = [item for item in scene.objects if item.kind == place.kind]
    if place.anchor in _COLOURS:
        like = [item for item in like if item.colour == place.anchor]
    return like[0] if len(like) == 1 else None
