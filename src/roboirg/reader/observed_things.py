"""Things by what is around them or happens to them: *the nearest one*, *the middle*, moves."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Callable, Collection, Iterator, Sequence

from roboirg.core.episode import Scene, SceneObject
from roboirg.core.motions import Swap
from roboirg.reader.object_positions import objects_at, scene_at_last
from roboirg.reader.phrases import Phrases, Span
from roboirg.reader.places import TIE, Place, place_mentions, present, ranked
from roboirg.reader.temporal_relations import Time

_NOUN = "(?P<noun>cube|container)"
_FIRST = "(?P<when>initially |at first |started |)"
_WHEN = f"(?:(?:that )?{_FIRST}(?:is |was )?(?:now )?)?"
_HAS = f"that {_FIRST}(?:now )?(?:has|had)"
_IN_A_ROW = Phrases({
    "the cube in the middle from left to right":
        rf"the {_NOUN} {_WHEN}(?:comes )?(?:in the middle|as the middle one)(?: now)? from "
        r"(?P<way>left to right|near to far)\b",
    "the middle cube from left to right":
        r"the middle (?P<cube>cube|container)(?: now)? from "
        r"(?P<row>left to right|near to far)\b",
})  # fmt: skip
_AS_MANY = Phrases({
    "the container that initially had as many containers in front of it as behind it":
        rf"the {_NOUN} {_HAS} as many (?:cubes|containers) "
        r"(?P<way>to its left as to its right|in front of it as behind it)\b",
})  # fmt: skip
_NEAREST = Phrases({
    "the cube nearest to the one closest to you":
        rf"the {_NOUN} {_WHEN}(?P<second>(?:second|2nd) )?(?:nearest|right next)"
        r"(?P<late> at first)? to the one ",
    "the nearest neighbor of the cube closest to you":
        r"the (?P<next>(?:second|2nd) )?nearest neighbor of the (?P<cube>cube|container) ",
})  # fmt: skip
_NOW = Phrases({"closest to you now": r" now\b"})
_SET_ASIDE = Phrases({
    "Forget the cube that started": rf"^(?:ignore|forget) the {_NOUN} (?P<when>that started |)",
})  # fmt: skip
_AND_ONE = Phrases({"now and the one that started": r"(?: now)? and the one (?:that started )?"})
_REMAINING = Phrases({
    "I want the one that is left":
        r"\bthe (?:one|cube|container) that is left\b",
    "I want the remaining one": r"\bthe (?:other|remaining) (?:one|cube|container)\b",
})  # fmt: skip
_NEITHER = Phrases({
    "the cube that is neither closest to you nor closest to the button":
        rf"the {_NOUN} {_WHEN}neither ",
})  # fmt: skip
_NOR = Phrases({"you nor closest to the button": " n?or "})
_ONLY_NOT = Phrases({
    "the only cube that is not closest to you or closest to the button":
        rf"the only {_NOUN} {_WHEN}not ",
})  # fmt: skip
_OR = Phrases({"you or closest to the button": " or "})
_MOVES = Phrases({
    "the container that never moved":
        "the container that (?:(?P<still>never move[sd]|stay(?:s|ed) where it (?:is|was))"
        r"|move[sd] (?:most often|more often than the rest))\b",
})  # fmt: skip
_CARRIED = Phrases({
    "the cube that was moved in the video":
        "the cube (?:from the video|that was carried in the video|that the video showed)"
        "|the cube that (?:was moved in the video|the video is about"
        r"|the robot (?:held|carried)(?: in the video)?)",
})  # fmt: skip


def with_remaining(sentences: Sequence[str]) -> list[str]:
    """Return the sentences with *forget two things. I want the one that is left* in one."""
    found: list[str] = []
    for text in sentences:
        aside = _SET_ASIDE.search(found[-1]) if found else None
        remaining = _REMAINING.search(text)
        if aside is not None and remaining is not None:
            read = _two_places(found[-1], aside.end(), _AND_ONE)
            if read is not None:
                words = [found[-1][start:end] for _, start, end in read]
                when = aside["when"] or "that is "
                meant = f"the {aside['noun']} {when}neither {words[0]} nor {words[1]}"
                found[-1] = f"{text[: remaining.start()]}{meant}{text[remaining.end() :]}"
                continue
        found.append(text)
    return found


def _two_places(text: str, start: int, joint: Phrases) -> list[tuple[Place, int, int]] | None:
    """Return two places with joining words between, each with where its words begin and end."""
    first = _place(text, start)
    then = joint.match(text, first[1]) if first else None
    second = _place(text, then.end()) if then else None
    if first is None or then is None or second is None:
        return None
    return [(first[0], start, first[1]), (second[0], then.end(), second[1])]


def observed_thing(text: str, scene: Scene) -> Iterator[Span]:
    """Yield the words for one thing, each with its color in words."""
    yield from _middles(text, scene)
    yield from _neighbors(text, scene)
    yield from _left_over(text, scene, _NEITHER, _NOR)
    yield from _left_over(text, scene, _ONLY_NOT, _OR)
    yield from _moving(text, scene)
    carried = {scene[fact.subject] for fact in scene.past if fact.kind == "placed"}
    for found in _CARRIED.finditer(text) if carried else ():
        yield (*found.span(), _named(carried, scene, "cube"))


def _middles(text: str, scene: Scene) -> Iterator[Span]:
    for phrases in (_IN_A_ROW, _AS_MANY):
        for found in phrases.finditer(text):
            words = found.groupdict()
            noun, way = words.get("cube") or found["noun"], words.get("row") or found["way"]
            middles: list[SceneObject] = []
            for at_time in _scenes(scene, noun, found["when"]):
                middles += _middle(present(at_time, noun), 1 if "left" in way else 0)
            yield (*found.span(), _named(middles, scene, noun))


def _middle(things: Sequence[SceneObject], axis: int) -> list[SceneObject]:
    """Return what has as many things on one side as on the other."""
    found: list[SceneObject] = []
    for item in things:
        away = [other.position[axis] - item.position[axis] for other in things if other != item]
        sides = [sum(sign * one > TIE for one in away) for sign in (1, -1)]
        if sides[0] == sides[1] > 0 and sum(sides) == len(away):
            found.append(item)
    return found


def _neighbors(text: str, scene: Scene) -> Iterator[Span]:
    for found in _NEAREST.finditer(text):
        read = _place(text, found.end())
        if read is None:
            continue
        (place, end), noun = read, found["noun"] or found["cube"]
        rank = 2 if found["second"] or found["next"] else 1
        nearest: list[SceneObject] = []
        for at_time in _scenes(scene, noun, found["when"] or found["late"]):
            for anchor in _at(place, at_time, noun):
                others = [item for item in present(at_time, noun) if item != anchor]
                nearest += ranked(others, rank, _distance(anchor), TIE)
        now = _NOW.match(text, end)
        yield found.start(), now.end() if now else end, _named(nearest, scene, noun)


def _left_over(text: str, scene: Scene, start: Phrases, joint: Phrases) -> Iterator[Span]:
    """Yield the words for what is left without two other things."""
    for found in start.finditer(text):
        read = _two_places(text, found.end(), joint)
        if read is None:
            continue
        left: list[SceneObject] = []
        for at_time in _scenes(scene, found["noun"], found["when"]):
            gone = {item for place, *_ in read for item in _at(place, at_time, found["noun"])}
            left += [item for item in present(at_time, found["noun"]) if item not in gone]
        yield found.start(), read[1][2], _named(left, scene, found["noun"])


def _moving(text: str, scene: Scene) -> Iterator[Span]:
    moves = Counter({item.name: 0 for item in scene.of_kind("container")})
    for swap in scene.motions_of(Swap):
        moves.update((swap.first, swap.second))
    for found in _MOVES.finditer(text) if moves else ():
        wanted = 0 if found["still"] else max(moves.values())
        things = [scene[name] for name, number in moves.items() if number == wanted]
        yield (*found.span(), _named(things, scene, "container"))


def _scenes(scene: Scene, noun: str, when: str | None) -> tuple[Scene, ...]:
    """Return the scene at the times that the words may mean: before and after things move."""
    if when or noun == "cube":
        return (scene,)
    return (scene, scene_at_last(scene))


def _place(text: str, start: int) -> tuple[Place, int] | None:
    """Return the place whose words begin at a character, and where they end."""
    words = tuple(text[start:].split())
    found = next(place_mentions(words), None)
    if found is None or found.start:
        return None
    return found.place, start + len(" ".join(words[: found.end]))


def _at(place: Place, scene: Scene, noun: str) -> tuple[SceneObject, ...]:
    first: tuple[Time, ...] = ("at first",)
    return objects_at(place, scene, noun, first, mirrored=False)


def _distance(anchor: SceneObject) -> Callable[[SceneObject], float]:
    return lambda item: math.dist(item.position[:2], anchor.position[:2])


def _named(things: Collection[SceneObject], scene: Scene, noun: str) -> str | None:
    """Return words with the only color of some things; None if they have none or several."""
    cubes = [item if item.color else scene.hidden_in(item.name) for item in things]
    colors = {cube.color if cube else None for cube in cubes}
    if len(colors) != 1 or None in colors:
        return None
    words = f"the {colors.pop()} cube"
    return f"the container over {words}" if noun == "container" else words
