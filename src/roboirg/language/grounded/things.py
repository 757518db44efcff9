"""Things by what is seen around them, or by what happens to them; no words name a color.

The colors of a scene are exchangeable: no place is more likely for one of them. So the words say
nothing about the goal's color.
"""

from __future__ import annotations

import itertools
from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from typing import NamedTuple

from roboirg.core.episode import Scene, SceneObject
from roboirg.core.motions import Away, Swap
from roboirg.core.word_pools import PoolName
from roboirg.language.grounded import grounded_templates as templates
from roboirg.language.grounded.clue import Clue, ClueKind
from roboirg.language.landmarks import LandmarkClass, Ranking, candidates_in, nearness, selectors
from roboirg.language.places import USUAL, PlaceClass, SpokenPlace, spoken_places
from roboirg.language.request import GoalValue, InstructionRequest
from roboirg.tasks import Task

AXES = ("x", "y")
FEW = 3
"""Things of which two are set aside."""
_ANCHORS = (LandmarkClass.EXTREME, LandmarkClass.FIXTURE)
"""Of the two things that are set aside."""
_SPOKEN: Mapping[PlaceClass, ClueKind] = {
    PlaceClass.EXTREME: "place",
    PlaceClass.FIXTURE: "place",
    PlaceClass.SIDE_OF_FIXTURE: "place",
    PlaceClass.CORNER: "place",
    PlaceClass.RANK: "place",
    PlaceClass.MIDDLE: "betweenness",
    PlaceClass.BETWEEN: "betweenness",
}
"""Places of language 4 that name no color, as clues."""
_ASIDE = (PlaceClass.EXTREME, PlaceClass.FIXTURE, PlaceClass.CORNER)
"""Places of language 4 of the two things that are set aside."""
_LINKS = (
    (0, _ANCHORS),
    (0, (LandmarkClass.CORNER,)),
    (0, (LandmarkClass.RANK,)),
    (1, _ANCHORS),
)
"""Of the thing whose neighbor is meant, after the neighbor's rank: 0 for the nearest. The later
ones only where there is nothing simpler."""


def thing_clues(request: InstructionRequest, color: GoalValue) -> list[Clue]:
    """Return the clues to the thing of a color, none of which names a color."""
    scene = request.episode.scene
    if request.values_of("placement") or request.values_of("relation"):
        # The cube in the video is the goal's in every scene, but not that of an arm's other goal.
        carried = {scene[fact.subject].color for fact in scene.past if fact.kind == "placed"}
        if carried != {color.value}:
            return []
        return [Clue("events", words) for words in templates.CARRIED.of(request.pool)]
    targets = request.objects_to_point_at(color)
    clues = _places(request, scene, targets)
    if request.values_of("amount") and scene.motions:
        # Some cubes arrive later: the words must fit before and afterwards.
        complete = replace(scene, motions=())
        afterwards = _places(request, complete, targets)
        clues = [one for one in clues if one in afterwards]
    return clues + _moves(request, color)


def _anchors(
    scene: Scene, thing: str, kinds: Sequence[LandmarkClass] = _ANCHORS
) -> list[tuple[str, SceneObject]]:
    """Return words for single places, each with what stands there."""
    found: list[tuple[str, SceneObject]] = []
    for one in selectors(scene, thing, "robot"):
        if one.landmark.kind > LandmarkClass.FIXTURE:
            break
        item = one.select()
        # "At your far left" needs a verb.
        if item and one.landmark.kind in kinds and not one.landmark.phrase.startswith("at "):
            found.append((one.landmark.phrase, item))
    return found


def _standing(task: Task) -> templates.Standing:
    words = task.commands.things_at
    if "started" in words:
        return templates.STOOD
    return templates.STANDS_NOW if "now" in words else templates.STANDS


def _places(
    request: InstructionRequest, scene: Scene, targets: Sequence[SceneObject]
) -> list[Clue]:
    """Return the words that single out one of the targets, from what stands around it."""
    thing, pool = request.task.commands.pointed, request.pool
    things = candidates_in(scene, thing)
    standing = _standing(request.task)
    fields = {**standing._asdict(), "noun": thing.removeprefix("hidden_")}
    form = int(bool(standing.started))
    found = _middles(things, targets, templates.MIDDLE.of(pool)[form], fields)
    for rank, kinds in _LINKS:
        anchors = _anchors(scene, thing, kinds)
        # What is harder to hear is only said where there is nothing simpler.
        if any(one.kind == "bridging" for one in found) or (rank and (found or len(things) <= FEW)):
            break
        words = templates.NEIGHBORS[rank].of(pool)[form]
        for anchor, other in anchors:
            others = [item for item in things if item is not other]
            if nearness(other.position).select(others, rank) in targets:
                found.append(Clue("bridging", words.format(anchor=anchor, **fields)))
    return found + _left_over(things, targets, _anchors(scene, thing), pool, fields)


def _middles(
    things: Sequence[SceneObject],
    targets: Sequence[SceneObject],
    words: str,
    fields: Mapping[str, str],
) -> list[Clue]:
    found: list[Clue] = []
    for axis in AXES:
        middle = Ranking(directed(axis, 1)).select(things, len(things) // 2)
        if len(things) % 2 and len(things) > 1 and middle in targets:
            found.append(Clue("betweenness", words.format(way=templates.WAYS[axis], **fields)))
    return found


def _left_over(
    things: Sequence[SceneObject],
    targets: Sequence[SceneObject],
    anchors: Sequence[tuple[str, SceneObject]],
    pool: PoolName,
    fields: Mapping[str, str],
) -> list[Clue]:
    """Return the words for the one of three things that is left when two are set aside."""
    found: list[Clue] = []
    (words,), (short,) = templates.LEFT_OVER.of(pool), templates.LEFT.of(pool)
    started_or_is = fields["started"] or ("that is now " if fields["now"] else "that is ")
    for (first, one), (second, other) in itertools.combinations(anchors, 2):
        left = [item for item in things if item not in (one, other)]
        if len(things) == FEW and len(left) == 1 and left[0] in targets and _differ(first, second):
            places = {**fields, "first": first, "second": second, "started_or_is": started_or_is}
            clue = Clue("sets", words.format(**places), short=short, aside=(first, second))
            found += [
                clue._replace(said=said.format(**places))
                for said in templates.LEFT_OVER_SAID.of(pool)
            ]
    return found


class SpokenClue(NamedTuple):
    """A clue in the words of language 4, and the thing that it leads to."""

    thing: SceneObject
    clue: Clue


def spoken_clues(scene: Scene, task: Task) -> list[SpokenClue]:
    """Return the clues of language 4 to all things that a task points at, by where they are.

    What has moved before the words are heard is *the container that started in the back*.
    """
    kind = task.commands.pointed
    noun, started = kind.removeprefix("hidden_"), _standing(task).started
    places = [place for place in spoken_places(scene, kind, "robot") if place.attributive]
    found = _with_others_aside(candidates_in(scene, kind), places)
    for place in places:
        words = f"the {noun} {started}{place.attributive}"
        clue = Clue(_SPOKEN.get(place.kind, "bridging"), words)
        # A neighbor is named where there is nothing else: *nearest to the one in the middle*.
        is_rare = place.kind > USUAL and "nearest to" in clue.words
        is_led_to = any(place.thing is known.thing for known in found)
        if place.kind in _SPOKEN or (is_rare and not is_led_to):
            found.append(SpokenClue(place.thing, clue))
    return found


def _with_others_aside(
    things: Sequence[SceneObject], places: Sequence[SpokenPlace]
) -> list[SpokenClue]:
    """Return the clues to each of three things by the places of the two others."""
    found: list[SpokenClue] = []
    simple = [place for place in places if place.kind in _ASIDE and len(things) == FEW]
    for first, second in itertools.combinations(simple, 2):
        left = [thing for thing in things if thing not in (first.thing, second.thing)]
        if len(left) == 1:
            aside = (first.said(None), second.said(None))
            found.append(SpokenClue(left[0], Clue("sets", " ".join(aside), aside=aside)))
    return found


def _differ(first: str, second: str) -> bool:
    """Return whether two places do not lie along the same line: near and far, left and right."""
    one, other = first.rsplit(maxsplit=1)[-1], second.rsplit(maxsplit=1)[-1]
    return one != other and {one, other} != {"left", "right"}


def directed(axis: str, sign: int) -> Callable[[SceneObject], float]:
    """Return the coordinate along an axis of the robot base frame, in either direction."""
    return lambda item: sign * (item.position.x if axis == "x" else item.position.y)


def late(scene: Scene) -> bool:
    """Return whether some cubes arrive later."""
    return any(motion.under is None for motion in scene.motions_of(Away))


def _moves(request: InstructionRequest, color: GoalValue) -> list[Clue]:
    """Return the words for a container by how often it changes places."""
    scene = request.episode.scene
    swaps = scene.motions_of(Swap)
    if not swaps:
        return []
    moves = Counter({item.name: 0 for item in scene.of_kind("container")})
    moves.update(name for swap in swaps for name in (swap.first, swap.second))
    over = next(item.inside for item in scene.objects if item.color == color.value)
    verbs = templates.SHOWN if request.episode.demonstration else templates.COMING
    kinds = {"still": 0, "most": max(moves.values())}
    return [
        Clue("events", words.format(**verbs), of_handled=True)
        for kind, number in kinds.items()
        if [name for name, found in moves.items() if found == number] == [over]
        for words in templates.MOVES[kind].of(request.pool)
    ]
