"""Resolve references: which objects and colors of a scene a description can mean."""

from __future__ import annotations

import functools
from dataclasses import replace

from roboirg.core.episode import Scene, SceneObject
from roboirg.reader.places import Place, Things, find_objects, things_of
from roboirg.reader.things import Description
from roboirg.tasks.shared.swapping import places_at_last

_CHOOSABLE_KINDS = ("box", "tape", "cube")
"""Goals choose among the objects of the first of these kinds that a scene has several of."""
MIN_TO_CHOOSE = 2
"""Objects of a kind from which on goals choose among them."""


class Referents:
    """What descriptions can mean in one scene.

    In a scene with a red and a blue cube, ``colors_of`` the description of *the red cube* is
    ``{"red"}``.

    Attributes:
        chosen: the kind of objects among whose colors the goals choose: ``box``, ``tape`` or
            ``cube``.
    """

    def __init__(self, scene: Scene) -> None:
        self._scene = scene
        self.chosen = "cube"
        for kind in _CHOOSABLE_KINDS:
            if len(things_of(scene, kind)) >= MIN_TO_CHOOSE:
                self.chosen = kind
                break
        # The kind that "the one on the left" means. Cubes under containers cannot be seen, unless
        # there is a button: then they lie open at first.
        self._kind_of_one = self.chosen
        if scene.of_kind("container") and not scene.of_kind("button"):
            self._kind_of_one = "container"

    def colors_of(self, thing: Description) -> set[str] | None:
        """Return the colors that a description can mean; None if it says nothing about the color.

        *the red cube* gives ``{"red"}``, *the cube on the left* the colors of all objects that may
        be meant there, and *the container over the red cube* the color of the cube. The set is
        empty if nothing in the scene fits.
        """
        if thing.same_color_as is not None:
            return self.colors_of(thing.same_color_as)
        if thing.covers is not None:
            return self.colors_of(thing.covers)
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
        """The colors of all objects that have one."""
        return {item.color for item in self._scene.objects if item.color}

    def _color(self, item: SceneObject) -> str | None:
        """Return the color of an object; of a container, that of the cube under it.

        None for a container without a cube, and for objects without a color.
        """
        if item.kind != "container":
            return item.color
        cube = self._scene.hidden_in(item.name)
        return None if cube is None else cube.color

    def things_at(self, thing: Description, place: Place) -> Things:
        """Return the objects of a description's kind and color that may be meant at a place.

        Swaps move objects: *now on the left* is meant of their end, *on the left at first* of the
        start. A description that does not say when may mean either.
        """
        names: dict[str, None] = {}  # each once, in order
        if thing.moment in ("start", None):
            at_start = self._find_at_place(thing, place, self._scene)
            names |= dict.fromkeys(item.name for item in at_start)
        if thing.moment in ("end", None):
            at_end = self._find_at_place(thing, place, scene_at_last(self._scene))
            names |= dict.fromkeys(item.name for item in at_end)
        return [self._scene[name] for name in names]

    def _find_at_place(self, thing: Description, place: Place, scene: Scene) -> Things:
        """Return the objects that a description can mean at a place, as they stand in `scene`.

        Objects of its kind are compared. If several have its color, only these are: *the red cube
        on the left* need not be left of the blue cubes. `scene` is that of the start or of the end.
        """
        kind = self._kind_of_one if thing.noun == "one" else thing.noun
        candidates = things_of(scene, kind)
        of_color = _of_color(candidates, thing.color)
        if len(of_color) > 1:
            candidates = of_color

        def find_anchors(anchor: object) -> Things:
            if isinstance(anchor, Description):
                return self._find_described_anchor(anchor, scene)
            fixtures = scene.of_kind(str(anchor))  # "bin"
            return fixtures if len(fixtures) == 1 else ()

        return find_objects(place, candidates, find_anchors)

    def _find_described_anchor(self, thing: Description, scene: Scene) -> Things:
        """Return the objects that the reference object of a place may be.

        In *next to the red cube* it is the red cube, and in *next to the cube on the left* any that
        may be meant on the left. By color alone it must be the only one of its kind, or none is
        returned.
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
    """Return the objects of a color, in their order; none if the color is None."""
    if color is None:
        return ()
    return [thing for thing in things if thing.color == color]
