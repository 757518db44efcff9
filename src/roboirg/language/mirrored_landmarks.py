"""What an instruction's places would mean to a listener who takes left for right."""

from __future__ import annotations

import itertools
import re
from collections.abc import Mapping
from typing import Any

from roboirg.core.episode import Episode, Scene, SceneObject
from roboirg.language.instruction import Instruction
from roboirg.language.landmarks import FRAMES
from roboirg.language.places import things_at
from roboirg.tasks import get_task

_SIDES = {"left": "right", "right": "left", "leftmost": "rightmost", "rightmost": "leftmost"}
_SIDE = re.compile(rf"\b({'|'.join(_SIDES)})\b(?! (?:by|next))")


def exchange_sides(words: str) -> str:
    """Return words with left and right exchanged."""
    return _SIDE.sub(lambda found: _SIDES[found[0]], words)


def mirrored_objects(episode: Episode, instruction: Instruction) -> Mapping[str, frozenset[str]]:
    """Return the objects that an instruction's places mean with left and right exchanged.

    Where the goal counts cubes, a place only gives their color, so all cubes of a color stand for
    one another. No object is given that the instruction means as well.

    Returns:
        For the name of each object that is meant, those that the exchanged words single out; empty
        if no place names left or right, or none of the exchanged places is clear.
    """
    metadata: Mapping[str, Any] = instruction.metadata
    places: list[str] = metadata["landmarks"]
    frame = metadata["frame"]
    if frame not in FRAMES or not any(map(_SIDE.search, places)):
        return {}
    objects = things_at(episode.scene, get_task(episode.task).commands.pointed, frame)
    alike = _of_same_color if "counts" in episode.goal.as_mapping() else _alone
    names: dict[str, frozenset[str]] = {}
    for phrase in itertools.chain(places, map(exchange_sides, places)):
        item = objects.get(phrase)
        if item is not None:
            names[phrase] = alike(episode.scene, item)
    all_meant = frozenset[str]().union(*(names[place] for place in places if place in names))
    found: dict[str, frozenset[str]] = {}
    for place in places:
        mirrored = names.get(exchange_sides(place), frozenset()) - all_meant
        if mirrored:
            found |= dict.fromkeys(names.get(place, ()), mirrored)
    return found


def _alone(_scene: Scene, item: SceneObject) -> frozenset[str]:
    return frozenset((item.inside or item.name,))


def _of_same_color(scene: Scene, item: SceneObject) -> frozenset[str]:
    same = (other for other in scene.objects if other.kind == item.kind)
    return frozenset(other.name for other in same if other.color == item.color)
