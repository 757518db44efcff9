"""Object positions: find what stands at a place before and after things move."""

from __future__ import annotations

import functools
from collections.abc import Collection
from dataclasses import replace

from roboirg.core.episode import Scene, SceneObject
from roboirg.reader.places import Place, find_objects
from roboirg.reader.temporal_relations import Time
from roboirg.tasks.shared.swapping import places_at_last


def objects_at(
    place: Place, scene: Scene, kind: str, times: Collection[Time], *, mirrored: bool
) -> tuple[SceneObject, ...]:
    """Return what stands at a place at one of these times, or at any time for no times."""
    found: list[str] = []
    if "at first" in times or not times:
        found += [item.name for item in find_objects(place, scene, kind, mirrored=mirrored)]
    if "at last" in times or not times:
        final = scene_at_last(scene)
        found += [item.name for item in find_objects(place, final, kind, mirrored=mirrored)]
    return tuple(scene[name] for name in dict.fromkeys(found))


@functools.lru_cache(maxsize=256)
def scene_at_last(scene: Scene) -> Scene:
    """Return the scene with everything where it stands after the last swap."""
    places = places_at_last(scene)
    moved = (replace(item, position=places[item.name]) for item in scene.objects)
    return replace(scene, objects=tuple(moved))
