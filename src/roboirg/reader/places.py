"""Places: read the words for a place, and find what stands there.

A place orders all things of one kind along a direction, or by their distance from something, and
means the first, second, ... of that order.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Literal, NamedTuple

from roboirg.core.episode import Scene, SceneObject
from roboirg.core.motions import Away
from roboirg.reader.tokens import Sentence, color_of, number_of, ordinal_of

Side = Literal["left", "right"]
_SIDES: dict[str, Side] = {"left": "left", "right": "right"}
_OUTERMOST: dict[str, Side] = {"leftmost": "left", "rightmost": "right"}
_NEAR = frozenset({"near", "close", "closest", "nearest", "front"})
_FAR = frozenset({"far", "farthest", "furthest", "away", "back"})
_NEAREST = frozenset({"closest", "nearest"})
_FARTHEST = frozenset({"farthest", "furthest"})
_ROBOT = frozenset({"you", "robot", "yourself"})
_FIXTURES = frozenset({"button", "target", "bin"})
_OWNERS = frozenset({"your", "camera's"})
_FILLERS = frozenset({"the", "to", "from", "a", "on", "at"}) | _OWNERS
_CORNER_FILLERS = frozenset({"of", "the", "table", "that", "is"})
_THINGS = frozenset({"cube", "container", "box", "tape"})
_COLORED = _THINGS - {"container"}
_PAIRED = _COLORED - {"cube"}
_BOTH = frozenset({"boxes", "tapes"})
_TO_A_SIDE = frozenset({"on", "to", "at"})
_SIDE_FILLERS = frozenset({"the", "far"}) | _OWNERS

_MAX_DEPTH = 4
"""Levels of places that other places describe; deeper ones are not read."""

_TABLE_FRONT, _TABLE_BACK = -0.7402, 0.4689
_TABLE_RIGHT, _TABLE_LEFT = -1.2149, 1.2030
"""Edges of the table's top, x and y in the world frame."""
_CAMERA = (0.3, 0.0, 0.4)
_VIEW = (-0.3, 0.0, -0.6)
"""The front camera's eye and where it looks from there."""
_CUBE_HEIGHT = 0.02
TIE = 0.01
"""Meters; the same words may mean things that differ by less."""
_TANGENT_TIE = 2 / 128
"""Two pixels, as a tangent: the picture is 256 pixels wide and 90 degrees."""


@dataclass(frozen=True, slots=True)
class DirectionalPlace:
    """A place along a direction of the table, or towards a corner if it has a side and a depth.

    Attributes:
        side: side of the robot, or None.
        depth: +1 away from the robot, -1 towards it, 0 neither.
        rank: 1 for the thing farthest in this direction.
    """

    side: Side | None
    depth: int
    rank: int = 1


@dataclass(frozen=True, slots=True)
class RelativePlace:
    """A place by its distance from an anchor.

    Attributes:
        anchor: kind of a fixture, a color, or a place.
        kind: kind of the anchor.
        nearest: whether small distances come first.
        rank: 1 for the first.
    """

    anchor: str | Place
    kind: str
    nearest: bool
    rank: int = 1


@dataclass(frozen=True, slots=True)
class MemberPlace:
    """A place among the few things at another one.

    Attributes:
        member: the place within the group.
        group: where its things stand.
        size: number of things in the group.
    """

    member: Place
    group: Place
    size: int


Place = DirectionalPlace | RelativePlace | MemberPlace


Measure = Callable[[SceneObject], float]
"""The order of things, small values first."""


class NamedPlace(NamedTuple):
    """A place, and whether the words before it say that a cube is there, not a container."""

    place: Place
    of_cube: bool = False


class ReadPlace(NamedTuple):
    """A place, and the index after its last word."""

    place: Place
    end: int


class PlaceMention(NamedTuple):
    """A place, and from which word to which it goes."""

    place: Place
    start: int
    end: int


def place_mentions(words: Sentence) -> Iterator[PlaceMention]:
    """Yield every place that a sentence names, in order."""
    at = 0
    while at < len(words):
        read = _read(words, at)
        if read is None:
            at += 1
        else:
            yield PlaceMention(read.place, at, read.end)
            at = read.end


def read_places(words: Sentence) -> tuple[NamedPlace, ...]:
    """Return every place that a sentence names, in order."""
    return tuple(
        NamedPlace(mention.place, _is_of_cube(words[: mention.start]))
        for mention in place_mentions(words)
    )


def _is_of_cube(before: Sentence) -> bool:
    nouns = (word.removesuffix("s") for word in reversed(before))
    return next((noun for noun in nouns if noun in _THINGS), None) == "cube"


def _read(words: Sentence, at: int, depth: int = 0) -> ReadPlace | None:
    """Return the place whose words begin at this word; None if none does."""
    read = _read_one(words, at, depth)
    return None if read is None else _read_group(words, *read, depth) or read


def _read_group(words: Sentence, member: Place, at: int, depth: int) -> ReadPlace | None:
    """Read ``among the two at the far left``, after the place of one of them."""
    number = _skip(words, at + 1)
    size = number_of(_word(words, number))
    if _word(words, at) != "among" or size is None or depth >= _MAX_DEPTH:
        return None
    start = _skip(words, number + 1)
    if _word(words, start).removesuffix("s") in _THINGS:
        start = _skip(words, start + 1)
    group = _read(words, start, depth + 1)
    if group is None:
        return None
    return ReadPlace(MemberPlace(member, group.place, size), group.end)


def _read_one(words: Sentence, at: int, depth: int) -> ReadPlace | None:
    """Read a place that is not one among others."""
    word = _word(words, at)
    rank = ordinal_of(word)
    if rank is not None:
        return _read_from(words, at + 1, rank) or _read_relative(words, at + 1, rank, depth)
    if word in _OUTERMOST:
        return ReadPlace(DirectionalPlace(_OUTERMOST[word], 0), at + 1)
    return (
        _read_side(words, at)
        or _read_corner(words, at)
        or _read_extreme(words, at)
        or _read_relative(words, at, 1, depth)
    )


def _read_side(words: Sentence, at: int) -> ReadPlace | None:
    """Read ``left box``, ``box on your left and the one on your right``, ``boxes on the left``."""
    word, following = _word(words, at), _word(words, at + 1)
    if word in _SIDES and following in _PAIRED:
        return ReadPlace(DirectionalPlace(_SIDES[word], 0), at + 2)
    second = (word == "and" and not _BOTH.isdisjoint(words[:at])) or (
        word == "one" and not _PAIRED.isdisjoint(words[:at])
    )
    if not (word in _PAIRED | _BOTH or second) or following not in _TO_A_SIDE:
        return None
    after = at + 2
    while _word(words, after) in _SIDE_FILLERS:
        after += 1
    side = _SIDES.get(_word(words, after))
    if side is None or _word(words, after + 1) in ("corner", *_PAIRED):
        return None
    return ReadPlace(DirectionalPlace(side, 0), after + 1)


def _read_extreme(words: Sentence, at: int) -> ReadPlace | None:
    """Read ``far left``, ``furthest to the right``."""
    if _word(words, at) not in _FAR:
        return None
    after = _skip(words, at + 1)
    side = _SIDES.get(_word(words, after))
    return None if side is None else ReadPlace(DirectionalPlace(side, 0), after + 1)


def _read_corner(words: Sentence, at: int) -> ReadPlace | None:
    """Read ``near left corner``, ``closest to the left corner that is far from you``."""
    start = at
    if _word(words, at) in _NEAREST:
        start = _skip(words, at + 1)
    word = _word(words, start)
    if word in _SIDES and _word(words, start + 1) == "corner":
        after = start + 2
        while _word(words, after) in _CORNER_FILLERS:
            after += 1
        depth = _depth(_word(words, after))
        robot = _skip(words, after + 1)
        if depth and _word(words, robot) in _ROBOT:
            return ReadPlace(DirectionalPlace(_SIDES[word], depth), robot + 1)
    side, depth = _SIDES.get(_word(words, start + 1)), _depth(word)
    if side is not None and depth and _word(words, start + 2) == "corner":
        return ReadPlace(DirectionalPlace(side, depth), start + 3)
    return None


def _read_from(words: Sentence, at: int, rank: int) -> ReadPlace | None:
    """Read ``from the left``, after an ordinal."""
    if _word(words, at) != "from":
        return None
    after = _skip(words, at)
    word = _word(words, after)
    if word in _SIDES:
        return ReadPlace(DirectionalPlace(_SIDES[word], 0, rank), after + 1)
    if word in ("front", "back"):
        return ReadPlace(DirectionalPlace(None, -1 if word == "front" else 1, rank), after + 1)
    return None


def _read_relative(words: Sentence, at: int, rank: int, depth: int) -> ReadPlace | None:
    """Read ``closest to you``, ``farthest from the button``, ``nearest to the red cube``."""
    word = _word(words, at)
    if word not in _NEAREST and word not in _FARTHEST:
        return None
    nearest = word in _NEAREST
    after = _skip(words, at + 1)
    noun, following = _word(words, after), _word(words, after + 1)
    if noun in _ROBOT:
        return ReadPlace(DirectionalPlace(None, -1 if nearest else 1, rank), after + 1)
    if noun in _FIXTURES:
        return _read_fixture(words, after, nearest=nearest, rank=rank)
    if color_of(noun) and following in _COLORED:
        return ReadPlace(RelativePlace(noun, following, nearest, rank), after + 2)
    if noun in _THINGS and depth < _MAX_DEPTH:
        inner = _read(words, _skip(words, after + 1), depth + 1)
        if inner is not None:
            return ReadPlace(RelativePlace(inner.place, noun, nearest, rank), inner.end)
    return None


def _read_fixture(words: Sentence, at: int, *, nearest: bool, rank: int) -> ReadPlace | None:
    """Read ``button``, ``target on your left``."""
    noun, side = words[at], _SIDES.get(_word(words, at + 3))
    if side is not None and words[at + 1 : at + 3] in (("on", "your"), ("on", "the")):
        return ReadPlace(RelativePlace(DirectionalPlace(side, 0), noun, nearest, rank), at + 4)
    return ReadPlace(RelativePlace(noun, noun, nearest, rank), at + 1)


def _word(words: Sentence, at: int) -> str:
    return words[at] if at < len(words) else ""


def _skip(words: Sentence, at: int) -> int:
    while _word(words, at) in _FILLERS:
        at += 1
    return at


def _depth(word: str) -> int:
    return -1 if word in _NEAR else 1 if word in _FAR else 0


def find_objects(
    place: Place, scene: Scene, kind: str, *, mirrored: bool
) -> tuple[SceneObject, ...]:
    """Return what stands at a place among the things of one kind; several for near ties.

    Cubes that appear later are not compared; containers appear together. If `mirrored`, left and
    right are those of the front camera's picture.
    """
    return _find(place, present(scene, kind), scene, mirrored=mirrored)


def _find(
    place: Place, candidates: list[SceneObject], scene: Scene, *, mirrored: bool
) -> tuple[SceneObject, ...]:
    found: list[SceneObject] = []
    if isinstance(place, MemberPlace):
        for group in _groups(place, candidates, scene, mirrored=mirrored):
            found += _find(place.member, group, scene, mirrored=mirrored)
    else:
        for others, measure, tie in _orders(place, candidates, scene, mirrored=mirrored):
            found += ranked(others, place.rank, measure, tie)
    return tuple(dict.fromkeys(found))


def _groups(
    place: MemberPlace, candidates: list[SceneObject], scene: Scene, *, mirrored: bool
) -> Iterator[list[SceneObject]]:
    """Yield the things that may be meant by a group; several for near ties at its border."""
    if isinstance(place.group, MemberPlace) or place.group.rank != 1:
        return
    for others, measure, tie in _orders(place.group, candidates, scene, mirrored=mirrored):
        border = ranked(others, place.size, measure, tie)
        if not border:
            continue
        outside = [item for item in others if measure(item) > max(map(measure, border))]
        inside = len(others) - len(border) - len(outside)
        for dropped in itertools.combinations(border, len(border) + inside - place.size):
            yield [item for item in others if item not in (*outside, *dropped)]


def _orders(
    place: DirectionalPlace | RelativePlace,
    candidates: list[SceneObject],
    scene: Scene,
    *,
    mirrored: bool,
) -> Iterator[tuple[list[SceneObject], Measure, float]]:
    """Yield what to compare, by what measure, and the margin of a tie; once for each anchor."""
    if isinstance(place, DirectionalPlace):
        yield (candidates, *_measure(place, mirrored=mirrored))
        return
    for anchor in _anchors(place, scene, mirrored=mirrored):
        away = _distance_to(*anchor.position[:2], 1.0 if place.nearest else -1.0)
        yield [item for item in candidates if item is not anchor], away, TIE


def present(scene: Scene, kind: str) -> list[SceneObject]:
    """Return the things of a kind, open or hidden, without cubes that appear later."""
    late: set[str] = set()
    if kind == "cube":
        late = {motion.subject for motion in scene.motions_of(Away) if motion.start == 0}
    kinds = ("cube", "hidden_cube") if kind == "cube" else (kind,)
    return [item for item in scene.objects if item.kind in kinds and item.name not in late]


def ranked(
    items: list[SceneObject], rank: int, measure: Measure, tie: float
) -> tuple[SceneObject, ...]:
    """Return the items of a rank, small measures first, with those that tie with them."""
    if rank > len(items):
        return ()
    wanted = sorted(map(measure, items))[rank - 1]
    return tuple(item for item in items if abs(measure(item) - wanted) <= tie)


def _measure(place: DirectionalPlace, *, mirrored: bool) -> tuple[Measure, float]:
    """Return the measure of a direction, the smallest first, and the margin of a tie."""
    if place.side is None:
        return lambda item: -place.depth * item.position.x, TIE
    left_of_robot = (place.side == "left") != mirrored
    if place.depth:
        x = _TABLE_FRONT if place.depth < 0 else _TABLE_BACK
        return _distance_to(x, _TABLE_LEFT if left_of_robot else _TABLE_RIGHT, 1.0), TIE
    if not mirrored:
        return lambda item: -item.position.y if left_of_robot else item.position.y, TIE
    return lambda item: _tangent(item) * (-1.0 if left_of_robot else 1.0), _TANGENT_TIE


def _distance_to(x: float, y: float, sign: float) -> Measure:
    return lambda item: sign * math.dist(item.position[:2], (x, y))


def _tangent(item: SceneObject) -> float:
    """Return the tangent of the horizontal angle from the front camera's axis to something."""
    offset = [part - eye for part, eye in zip(item.position[:2], _CAMERA[:2], strict=True)]
    ahead = offset[0] * _VIEW[0] + offset[1] * _VIEW[1] + (_CUBE_HEIGHT - _CAMERA[2]) * _VIEW[2]
    return item.position.y * math.hypot(*_VIEW) / ahead


def _anchors(place: RelativePlace, scene: Scene, *, mirrored: bool) -> tuple[SceneObject, ...]:
    if not isinstance(place.anchor, str):
        return find_objects(place.anchor, scene, place.kind, mirrored=mirrored)
    like = present(scene, place.kind)
    if color_of(place.anchor):
        like = [item for item in like if item.color == place.anchor]
    return tuple(like) if len(like) == 1 else ()
