"""Referents: the colors that a description of a thing can mean in a scene."""

from __future__ import annotations

import functools
from dataclasses import replace

from roboirg.core.episode import Scene, SceneObject
from roboirg.reader.places import Place, Things, find_objects, things_of
from roboirg.reader.things import Description
from roboirg.tasks.shared.swapping import places_at_last

_CHOOSABLE_KINDS = ("box", "tape", "cube")
"""Of these kinds, the first that a scene has is the one among which goals choose."""
MIN_TO_CHOOSE = 2
"""Things of a kind from which on goals choose among them."""


class Referents:
    """What descriptions can mean in a scene.

    Attributes:
        chosen: the kind of things among whose colors the goals choose.
    """

    def __init__(self, scene: Scene) -> None:
        self._scene = scene
        self.chosen = "cube"
        for kind in _CHOOSABLE_KINDS:
            if len(things_of(scene, kind)) >= MIN_TO_CHOOSE:
                self.chosen = kind
                break
        self._pointed = self.chosen  # what "the one on the left" is
        # Where there is a button, the cubes lie open at first.
        if scene.of_kind("container") and not scene.of_kind("button"):
            self._pointed = "container"

    def colors_of(self, thing: Description) -> set[str] | None:
        """Return the colors that a description can mean; None if it says nothing about them.

        *the red cube* gives ``{"red"}``, *the cube on the left* the colors of what may be meant
        there, and *the container over the red cube* that of the cube. Empty if nothing in the scene
        fits.
        """
        if thing.like is not None:
            return self.colors_of(thing.like)
        if thing.under is not None:
            return self.colors_of(thing.under)
        colors: set[str] | None = None
        if thing.color is not None:
            colors = {thing.color} & self.colors  # empty if nothing there has it
        if thing.place is not None:
            colors_there = {self._color(item) for item in self.things_at(thing, thing.place)}
            at_place = {color for color in colors_there if color is not None}
            colors = at_place if colors is None else colors & at_place
        return colors

    def count_of(self, color: str) -> int:
        """Return how many cubes of a color there are."""
        return len(_of_color(things_of(self._scene, "cube"), color))

    @property
    def colors(self) -> set[str]:
        """The colors of all things that have one."""
        return {item.color for item in self._scene.objects if item.color}

    def _color(self, item: SceneObject) -> str | None:
        """Return the color of a thing; of a container, that of the cube under it."""
        if item.kind != "container":
            return item.color
        cube = self._scene.hidden_in(item.name)
        return None if cube is None else cube.color

    def things_at(self, thing: Description, place: Place) -> Things:
        """Return the things of a description's kind and color that its place may mean.

        *Now on the left* is meant of the end, after all swaps, and *on the left at first* of the
        start; without such words it may be either.
        """
        names: dict[str, None] = {}  # each once, in order
        if thing.moment in ("first", None):
            names |= dict.fromkeys(
                item.name for item in self._find_at_place(thing, place, self._scene)
            )
        if thing.moment in ("last", None):
            at_last = scene_at_last(self._scene)
            names |= dict.fromkeys(item.name for item in self._find_at_place(thing, place, at_last))
        return [self._scene[name] for name in names]

    def _find_at_place(self, thing: Description, place: Place, scene: Scene) -> Things:
        """Return the things that a description can mean at its place, as they stand in `scene`.

        Where several have its color, they are compared with each other, and with no others: *the
        red cube on the left* need not be left of the blue ones.
        """
        kind = self._pointed if thing.noun == "one" else thing.noun
        candidates = things_of(scene, kind)
        of_color = _of_color(candidates, thing.color)
        if len(of_color) > 1:
            candidates = of_color

        def find_anchors(anchor: object) -> Things:
            if isinstance(anchor, Description):
                return self._find_anchor(anchor, scene)
            fixtures = scene.of_kind(str(anchor))
            return fixtures if len(fixtures) == 1 else ()

        return find_objects(place, candidates, find_anchors)

    def _find_anchor(self, thing: Description, scene: Scene) -> Things:
        """Return the things that words like *next to the red cube* may name: here the red cube.

        By its color it must be the only one; else none is returned.
        """
        if thing.place is not None:
            return self._find_at_place(thing, thing.place, scene)
        kind = "cube" if thing.noun == "one" else thing.noun
        of_color = _of_color(things_of(scene, kind), thing.color)
        return of_color if len(of_color) == 1 else ()


@functools.lru_cache(maxsize=256)
def scene_at_last(scene: Scene) -> Scene:
    """Return the scene with everything where it stands after the last swap."""
    places = places_at_last(scene)
    moved = [replace(item, position=places[item.name]) for item in scene.objects]
    return replace(scene, objects=tuple(moved))


def _of_color(things: Things, color: str | None) -> Things:
    """Return the things of a color; none without a color."""
    if color is None:
        return ()
    return [thing for thing in things if thing.color == color]
