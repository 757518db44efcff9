"""The listener: what each part of the command can mean, given the context and the scene."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from typing import TypeVar

from roboirg.core.episode import ObjectKind, Scene, SceneObject
from roboirg.core.motions import Shuttle
from roboirg.language.interpreter.command import Item
from roboirg.language.interpreter.descriptions import Description
from roboirg.language.interpreter.discourse_context import DiscourseContext
from roboirg.language.interpreter.object_positions import objects_at
from roboirg.language.interpreter.ordinals import OrdinalExpression
from roboirg.language.interpreter.places import Place
from roboirg.language.interpreter.quantities import CountExpression
from roboirg.language.interpreter.temporal_relations import (
    MOMENTS,
    PressRelation,
    TemporalRelation,
    Time,
    neighbors,
)

Told = TypeVar("Told")
_CHOSEN: tuple[ObjectKind, ...] = ("container", "box", "tape")
"""Kinds of things among which commands choose, rather than among cubes, the first that there is."""

Amounts = dict[str, set[int] | None]
"""For each color that is possible, how many; None if any number is."""


class ReferenceResolver:
    """Evaluates the command's descriptions; None stands for "nothing tells".

    Attributes:
        complaints: what was pointed at without having been introduced, and the like.
    """

    def __init__(self, scene: Scene, context: DiscourseContext, times: frozenset[Time]) -> None:
        self.complaints: list[str] = []
        self._scene = scene
        self._context = context
        self._times = times
        kinds = {item.kind for item in scene.objects}
        self._kind = next((kind for kind in _CHOSEN if kind in kinds), "cube")

    @property
    def chooses_box(self) -> bool:
        """Whether commands choose among boxes to put something into."""
        return self._kind == "box"

    def objects(self, thing: Description) -> set[str] | None:
        """The colors that a description leaves open; None if it says nothing."""
        if thing.kind == "any":
            return None
        if thing.kind == "color":
            return set(thing.colors)
        if thing.kind == "place" and thing.place is not None:
            return self._at(thing.place, thing.times)
        if thing.kind == "introduced place":
            return self._introduced_place(thing)
        if thing.kind == "introduced":
            return self._introduced(thing)
        return self._derived(thing)

    def amounts(self, item: Item) -> Amounts:
        """For each color that an item leaves open, the numbers that it leaves open."""
        colors = self.objects(item.thing)
        if colors is None:
            colors = self._colors()
        count = item.number
        if count is None:
            return dict.fromkeys(colors)
        return {color: count.results(self._told(count, color)) for color in sorted(colors)}

    def times(self, count: CountExpression | None) -> set[int] | None:
        """The numbers that the command leaves open."""
        return None if count is None else count.results(self._told(count, None))

    def _told(self, count: CountExpression, color: str | None) -> tuple[int, ...]:
        """The introduced numbers that a count may start from; of that color, if there are any."""
        if count.quantity is not None:
            return ()
        of_color = tuple(number for shade, number in self._context.amounts if shade == color)
        told = of_color or self._context.numbers
        if not told:
            self._complain("a number")
        return told

    def positions(self, position: OrdinalExpression | None) -> set[int] | None:
        """The elements of the series that the command leaves open."""
        if position is None:
            return None
        positions, numbers = self._context.positions, self._context.numbers
        if position.points and not positions and not numbers:
            self._complain("an element of a series")
        return position.results(positions, numbers, self._series_length())

    def moments(self, when: TemporalRelation | None) -> set[PressRelation] | None:
        """The moments about the press that the command leaves open."""
        if when is None:
            return None
        told = set(when.moments) or self._introduced_moments(when)
        if not told:
            self._complain("a moment")
            return None
        if when.kind == "neighbor":
            return neighbors(told, self._scene.past)
        if when.kind == "other":
            # Of two that were named without a choice, either may be the other one.
            return set(MOMENTS) - told if len(told) == 1 else set(MOMENTS)
        return told

    def _introduced_moments(self, when: TemporalRelation) -> set[PressRelation]:
        chosen = self._context.chosen
        if chosen is not None and (when.kind != "introduced" or len(self._context.moments) > 1):
            return {chosen}
        return set(self._context.moments)

    def _series_length(self) -> int:
        passes = [motion.passes for motion in self._scene.motions if isinstance(motion, Shuttle)]
        discs = {disc.name for disc in self._scene.of_kind("target")}
        placed = [fact for fact in self._scene.past if fact.kind == "placed"]
        return sum(passes) or sum(fact.place in discs for fact in placed)

    def _derived(self, thing: Description) -> set[str] | None:
        named = set(thing.colors or self._context.colors)
        if thing.kind == "not":
            if not named:
                self._complain("excluded colors")
                return None
            return self._colors() - named
        minus = thing.minus or self._context.singled
        if not named or minus is None:
            self._complain("the one that is not meant")
        return (named or self._colors()) - {str(minus)}

    def _introduced(self, thing: Description) -> set[str] | None:
        if self._context.places and not self._context.colors:
            return self._introduced_place(thing)
        chosen = _chosen(self._context.colors, thing.position)
        if not chosen:
            self._complain("a color")
            return None
        return set(chosen)

    def _introduced_place(self, thing: Description) -> set[str] | None:
        chosen = _chosen(self._context.places, thing.position)
        if not chosen:
            self._complain("a place")
            return None
        return set().union(*(self._at(place, thing.times) for place in chosen))

    def _at(self, place: Place, times: frozenset[Time]) -> set[str]:
        found = objects_at(
            place,
            self._scene,
            self._kind,
            times | self._times,
            mirrored=self._context.mirrored,
        )
        cubes = [item if item.color else self._scene.hidden_in(item.name) for item in found]
        if None in cubes or not cubes:
            self.complaints.append(f"nothing to handle at {place}")
        return {str(cube.color) for cube in cubes if cube is not None}

    def _colors(self) -> set[str]:
        return {str(cube.color) for cube in self._cubes()}

    def _cubes(self) -> Iterator[SceneObject]:
        return (item for item in self._scene.objects if item.color is not None)

    def _complain(self, what: str) -> None:
        self.complaints.append(f"{what}: nothing before the command introduces it")


def common(options: Iterable[set[str] | None]) -> set[str] | None:
    """What all of these leave open; None if none of them says anything."""
    told = [one for one in options if one is not None]
    return set.intersection(*told) if told else None


def _chosen(introduced: tuple[Told, ...], position: int | None) -> tuple[Told, ...]:
    """The introduced one at a position, or all of them."""
    if position is None:
        return introduced
    return introduced[position:][:1]
