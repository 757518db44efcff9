"""Reference resolution: find what each part of a command can mean, given context and scene."""

from __future__ import annotations

from collections.abc import Iterable
from typing import TypeVar

from roboirg.core.episode import ObjectKind, Scene
from roboirg.core.motions import Shuttle
from roboirg.reader.command import Item
from roboirg.reader.descriptions import Description
from roboirg.reader.discourse_context import DiscourseContext
from roboirg.reader.object_positions import objects_at
from roboirg.reader.ordinals import OrdinalExpression
from roboirg.reader.places import NamedPlace
from roboirg.reader.quantities import CountExpression
from roboirg.reader.several_amounts import SeveralAmounts
from roboirg.reader.temporal_relations import (
    MOMENTS,
    PressRelation,
    TemporalRelation,
    Time,
    neighbors,
)

Referent = TypeVar("Referent")
_CHOICE_KINDS: tuple[ObjectKind, ...] = ("container", "box", "tape")
"""Commands choose among the things of the first kind here that the scene has, else among cubes."""

Amounts = dict[str, set[int] | None]
"""The possible numbers for each possible color; None if any number is possible."""


class ReferenceResolver:
    """Resolver of descriptions; its methods return None where the command allows everything.

    Attributes:
        complaints: what the descriptions point at in vain, in plain sentences.
    """

    def __init__(
        self,
        scene: Scene,
        context: DiscourseContext,
        times: frozenset[Time],
        *,
        mirrored: bool = False,
    ) -> None:
        self.complaints: list[str] = []
        self._mirrored = mirrored
        self._scene = scene
        self._context = context
        self._times = times
        kinds = {item.kind for item in scene.objects}
        self._kind = next((kind for kind in _CHOICE_KINDS if kind in kinds), "cube")

    @property
    def chooses_box(self) -> bool:
        """Whether commands choose among boxes."""
        return self._kind == "box"

    def colors_of(self, thing: Description) -> set[str] | None:
        """Return the colors that fit a description."""
        if thing.kind == "any":
            return None
        if thing.kind == "color":
            return self._present_colors(thing.colors)
        if thing.kind == "place" and thing.place is not None:
            return self._at(thing.place, thing.times)
        if thing.kind == "introduced place":
            return self._introduced_place(thing)
        if thing.kind in ("introduced", "remaining"):
            return self._introduced(thing)
        return self._derived(thing)

    def amounts(self, item: Item) -> Amounts:
        """Return the colors that fit an item, with the numbers that fit it."""
        colors = self.colors_of(item.thing)
        if colors is None:
            colors = self._colors()
        count = item.number
        if count is None:
            return dict.fromkeys(colors)
        return {
            color: count.results(self._introduced_numbers(count, color)) for color in sorted(colors)
        }

    def several_amounts(self, words: SeveralAmounts) -> list[Amounts]:
        """Return the amount of each color that words for all of them mean."""
        if not (words.amounts or self._context.amounts):
            self._complain("amounts")
        elif not words.amounts and len(self._context.colors) > len(self._context.amounts):
            self._complain("an amount of each color")
            return [dict.fromkeys(self._colors())]
        return [{color: numbers} for color, numbers in words.results(self._context.amounts)]

    def repeats(self, count: CountExpression | None) -> set[int] | None:
        """Return the numbers of repetitions that fit an expression; once, without any number."""
        if count is None:
            return None if set(self._context.numbers) - {1} else {1}
        return count.results(self._introduced_numbers(count, None))

    def _introduced_numbers(self, count: CountExpression, color: str | None) -> tuple[int, ...]:
        """Return the numbers to start from: those introduced with the color, else all."""
        if count.quantity is not None:
            return ()
        of_color = tuple(number for shade, number in self._context.amounts if shade == color)
        numbers = of_color or self._context.numbers
        if count.remaining:
            numbers = tuple(one for one in numbers if one != self._context.preferred_number)
        if not numbers:
            self._complain("a number")
        return numbers

    def positions(self, position: OrdinalExpression | None) -> set[int] | None:
        """Return the elements of the series that fit a description."""
        if position is None:
            return None
        positions, numbers = self._context.positions, self._context.numbers
        if position.base == "other" and self._context.selected:
            positions = numbers = ()  # what is taken, "the second one", may be a rank or a visit
        elif position.base == "other":
            preferred = self._context.preferred_position
            positions = tuple(one for one in positions if one != preferred)
        if position.points and not positions and not numbers:
            self._complain("an element of a series")
        return position.results(positions, numbers, self._series_length())

    def moments(self, when: TemporalRelation | None) -> set[PressRelation] | None:
        """Return the moments about the press that fit a description."""
        if when is None:
            return None
        moments = set(when.moments) or self._introduced_moments(when)
        if not moments:
            self._complain("a moment")
            return None
        if when.kind == "neighbor":
            return neighbors(moments, self._scene.past)
        if when.kind == "other":
            # Without a preference, either of the two may be the other one.
            return set(MOMENTS) - moments if len(moments) == 1 else set(MOMENTS)
        return moments

    def moments_at(self, position: OrdinalExpression | None) -> set[PressRelation] | None:
        """Return the moments of the elements of the series that fit a description."""
        if position is None or position.points or self._series_length() != len(MOMENTS):
            return None
        numbers = position.results((), (), len(MOMENTS))
        return None if numbers is None else {MOMENTS[number - 1] for number in numbers}

    def _introduced_moments(self, when: TemporalRelation) -> set[PressRelation]:
        """Return the moments to start from: the preferred one, if a choice has to be made."""
        preferred = self._context.preferred_moment
        if preferred and (when.kind != "introduced" or len(self._context.moments) > 1):
            return {preferred}
        return set(self._context.moments)

    def _series_length(self) -> int:
        """Return how many visits a shuttle makes, or placements on discs the video shows."""
        passes = [shuttle.passes for shuttle in self._scene.motions_of(Shuttle)]
        discs = {disc.name for disc in self._scene.of_kind("target")}
        placed = [fact for fact in self._scene.past if fact.kind == "placed"]
        return sum(passes) or sum(fact.place in discs for fact in placed)

    def _derived(self, thing: Description) -> set[str] | None:
        named = set(thing.colors or self._context.colors)
        if thing.kind == "not":
            if not named:
                self._complain("the excluded colors")
                return None
            return self._colors() - named
        excluded = thing.excluded or self._context.preferred_color
        if not named or excluded is None:
            self._complain("the excluded color")
        return (named or self._colors()) - {str(excluded)}

    def _introduced(self, thing: Description) -> set[str] | None:
        preferred = self._context.preferred_color
        if thing.kind == "remaining" and preferred is not None:
            return set(self._context.colors) - {preferred}
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

    def _at(self, named: NamedPlace, times: frozenset[Time]) -> set[str]:
        found = objects_at(
            named.place,
            self._scene,
            "cube" if named.of_cube else self._kind,
            times | self._times,
            mirrored=self._context.mirrored or self._mirrored,
        )
        cubes = [item if item.color else self._scene.hidden_in(item.name) for item in found]
        if None in cubes or not cubes:
            self.complaints.append("there is nothing to handle at the place that the text names")
        return {str(cube.color) for cube in cubes if cube is not None}

    def _present_colors(self, colors: Iterable[str]) -> set[str]:
        """Return the colors, and complain about one that nothing in the scene has."""
        present = self._colors()
        for color in colors:
            if color not in present:
                self.complaints.append(f"there is nothing {color} in the scene")
        return set(colors)

    def _colors(self) -> set[str]:
        return {str(item.color) for item in self._scene.objects if item.color is not None}

    def _complain(self, what: str) -> None:
        self.complaints.append(f"nothing before the command introduces {what}")


def common_options(options: Iterable[set[str] | None]) -> set[str] | None:
    """Return what all of these allow; None if all of them allow everything."""
    limits = [one for one in options if one is not None]
    return set.intersection(*limits) if limits else None


def _chosen(introduced: tuple[Referent, ...], position: int | None) -> tuple[Referent, ...]:
    """Return the referent at a position, or all referents for the position None."""
    if position is None:
        return introduced
    return introduced[position:][:1]
