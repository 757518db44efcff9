"""Clues: words for what only who sees the scene or the video can know.

A clue is known by its words: whoever hears them finds the thing or the value here, without the
goal. No clue names a color: the colors of a scene are exchangeable, and no place is more likely for
one of them, so the words say nothing about the goal's color.
"""

from __future__ import annotations

import itertools
from collections.abc import Iterator, Sequence
from typing import Literal, NamedTuple

from roboirg.core.episode import Scene, SceneObject
from roboirg.core.goal_slots import MOMENTS
from roboirg.core.motions import Swap
from roboirg.language.landmarks import MARGIN, candidates_in
from roboirg.language.places import PlaceClass, SpokenPlace, spoken_places
from roboirg.tasks import Task

ClueKind = Literal["counts", "events", "betweenness", "sets", "place"]
CUBES_LEFT_OVER = 3
"""Cubes that *all but three* leaves: BinFill's easy scenes allow it for every number."""
SHARE_BY_SWAPS = {1: (1, 2), 2: (1, 3), 3: (1, 1)}
"""Share of the scenes with this number of swaps that say it, so that all are equally frequent.

Of easy scenes half have one swap and half two, of medium ones half two and half three; two of four
episodes are easy, one is medium.
"""
_MIDDLE_PLACES = (PlaceClass.MIDDLE, PlaceClass.BETWEEN)
"""Places for which what stands on both sides is looked at."""
_EXCLUDING_PLACES = (PlaceClass.EXTREME, PlaceClass.FIXTURE, PlaceClass.CORNER)
"""Places of the two things that are set aside."""
_EXCLUSION_SIZE = 3
"""Things of which two are set aside."""
_SIDE_BY_SIGN = {1: "left", -1: "right"}
"""By the sign of y in the robot base frame."""


class Clue(NamedTuple):
    """Words for a value that only who sees the scene or the video can tell.

    *The cube in the middle* for its color.

    Attributes:
        kind: what has to be seen.
        words: for the thing, the number or the placement.
        short: for a number of times, words that end a command, *once for each red cube …*.
        aside: the places of the other two of three things, if these are what the words say.
    """

    kind: ClueKind
    words: str
    short: str = ""
    aside: tuple[str, ...] = ()


class ThingClue(NamedTuple):
    """Words for a thing that only who sees the scene can tell, and the thing."""

    thing: SceneObject
    clue: Clue


class EventClue(NamedTuple):
    """Words for what the video shows, and the value of a goal's slot that they lead to.

    *The cube that the robot moved* leads to ``red`` in the slot ``color``.

    Attributes:
        slot: ``color``, ``placement``, ``relation`` or ``repeats``.
        value: of that slot.
        clue: its words.
        share: in how many of how many scenes with it, (1, 3) for a third, it is said; None for all.
    """

    slot: str
    value: str | int
    clue: Clue
    share: tuple[int, int] | None = None


def thing_clues(scene: Scene, task: Task) -> list[ThingClue]:
    """Return words that lead to each thing that commands point at, by where it stands.

    ``the cube in the middle`` leads to the cube there; no color is named. What changes places
    before the words are heard is named by its first place: *the container that started in the
    back*.
    """
    kind = task.things.pointed
    noun = kind.removeprefix("hidden_")
    # After a video in which things change places, words must name where each one stood first.
    if scene.motions_of(Swap) and task.demonstration(scene):
        noun += " that started"
    places = [place for place in spoken_places(scene, kind, "robot") if place.attributive]
    clues = _clues_by_exclusion(candidates_in(scene, kind), places)
    for place in places:
        if place.kind in (PlaceClass.COLOR, PlaceClass.UNUSUAL):
            continue  # no clue names a color, or is what no one says
        clue_kind: ClueKind = "betweenness" if place.kind in _MIDDLE_PLACES else "place"
        clue = Clue(clue_kind, f"the {noun} {place.attributive}")
        clues.append(ThingClue(place.thing, clue))
    return clues


def _clues_by_exclusion(
    things: Sequence[SceneObject], places: Sequence[SpokenPlace]
) -> list[ThingClue]:
    """Return clues to one of three things by the places of the two others, which are set aside.

    If one is *on the left* and one *next to the button*, these two places lead to the third thing.
    Empty unless there are exactly three things.
    """
    if len(things) != _EXCLUSION_SIZE:
        return []
    clues = []
    simple_places = [place for place in places if place.kind in _EXCLUDING_PLACES]
    for first, second in itertools.combinations(simple_places, 2):
        remaining = [thing for thing in things if thing not in (first.thing, second.thing)]
        # Two remain if both places are of the same thing.
        if len(remaining) == 1:
            places_aside = (first.said(), second.said())
            clue = Clue("sets", " ".join(places_aside), aside=places_aside)
            clues.append(ThingClue(remaining[0], clue))
    return clues


def event_clues(scene: Scene) -> Iterator[EventClue]:
    """Yield words for what the demonstration video shows, each with the goal value it leads to.

    *The cube that the robot moved* leads to the value ``red`` of the goal's slot ``color``. Yields
    nothing if there is no video.
    """
    kinds_of_past_acts = [fact.kind for fact in scene.past]
    # Some videos show a cube that is placed on targets, others a cube that is picked up.
    if "placed" in kinds_of_past_acts:
        yield from _moved_cube(scene)
        yield from _visited_targets(scene)
        yield _target_at_press(scene)
    elif "picked" in kinds_of_past_acts:
        yield from _swaps(scene)
        yield from _cubes_on_sides(scene)


def _moved_cube(scene: Scene) -> Iterator[EventClue]:
    """Yield *the cube that the robot moved*, which leads to its color, if there are other cubes.

    The video must show that a cube is placed.
    """
    moved = scene[scene.past[0].subject]
    if len(scene.of_kind("cube")) > 1:
        clue = Clue("events", "the cube that the robot moved")
        yield EventClue("color", str(moved.color), clue)


def _visited_targets(scene: Scene) -> Iterator[EventClue]:
    """Yield clues to the targets on which the video's cube was put, by where the targets lay.

    *The target on the left* leads to ``placement`` 2 if the cube was put there second. If the video
    has one placement before and one after the press of the button, it also leads to ``relation``.
    """
    visited = [fact.place for fact in scene.past if fact.kind == "placed"]
    # The button is pressed between two placements: one is before the press, one after it.
    is_around_press = [fact.kind for fact in scene.past] == ["placed", "pressed", "placed"]
    noun = "target that started" if scene.motions_of(Swap) else "target"
    for place in spoken_places(scene, "target", "robot"):
        is_said = place.attributive and place.kind < PlaceClass.UNUSUAL
        if not is_said or place.thing.name not in visited:
            continue
        clue = Clue("place", f"the {noun} {place.attributive}")
        times_before = visited.index(place.thing.name)
        yield EventClue("placement", times_before + 1, clue)
        if is_around_press:
            yield EventClue("relation", MOMENTS[times_before], clue)


def _target_at_press(scene: Scene) -> EventClue:
    """Return words for the target on which the cube lay when the button was pressed.

    They lead to ``placement`` 2 if the cube had been put on two targets before.
    """
    acts = [fact.kind for fact in scene.past]
    words = "the target that the cube was on when the button was pressed"
    placements_before = acts.index("pressed")  # the cube is then on the last of these
    return EventClue("placement", placements_before, Clue("events", words))


def _swaps(scene: Scene) -> Iterator[EventClue]:
    """Yield a clue to a number of repeats: *as many times as the cubes switched places*.

    Nothing is yielded if the video shows no swap, or more than three.
    """
    swaps = len(scene.motions_of(Swap))
    if swaps in SHARE_BY_SWAPS:
        words = "the cubes switched places"
        clue = Clue("events", words, f"as many times as {words}")
        yield EventClue("repeats", swaps, clue, SHARE_BY_SWAPS[swaps])


def _cubes_on_sides(scene: Scene) -> Iterator[EventClue]:
    """Yield clues to a number of repeats: how many cubes of a color are left or right of another.

    *Once for each red cube to the left of the cube from the video* leads to ``repeats`` 2 if two
    red cubes are there. The video must show that a cube is picked up. Yields nothing if all cubes
    have one color, as in scenes where they change places.
    """
    shown = scene[scene.past[0].subject]
    cubes = scene.of_kind("cube")
    colors = list(dict.fromkeys(str(cube.color) for cube in cubes))
    if len(colors) == 1:
        return
    for color in colors:
        other_cubes = [cube for cube in cubes if cube.color == color and cube != shown]
        for sign, side in _SIDE_BY_SIGN.items():
            number = _count_on_side(other_cubes, shown, sign)
            if number:  # neither unclear nor zero
                yield EventClue("repeats", number, _clue_to_side(color, side))


def _clue_to_side(color: str, side: str) -> Clue:
    """Return words for the number of cubes of a color on a side of the cube in the video.

    *red cubes to the left of the cube from the video*.
    """
    where = f"to the {side} of the cube from the video"
    return Clue("counts", f"{color} cubes {where}", f"once for each {color} cube {where}")


def _count_on_side(things: Sequence[SceneObject], reference: SceneObject, sign: int) -> int | None:
    """Return how many things are on one side of a reference; None if that is unclear for one.

    Unclear is a thing within two margins (6 cm) of the reference along y. `sign` is 1 for the
    robot's left, where y is larger, and -1 for its right.
    """
    count = 0
    for thing in things:
        distance = sign * (thing.position.y - reference.position.y)
        if abs(distance) < 2 * MARGIN:
            return None  # it is nearly in line, so people may see it on either side
        if distance > 0:
            count += 1
    return count
