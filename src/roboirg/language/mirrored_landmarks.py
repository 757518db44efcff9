"""What an instruction's place would mean to a listener who takes left for right."""

from __future__ import annotations

import re
from collections.abc import Mapping
from typing import Any

from roboirg.core.episode import Episode, SceneObject
from roboirg.language.instruction import Instruction
from roboirg.language.places import things_at
from roboirg.tasks import get_task

_OPPOSITE_SIDE = {
    "left": "right",
    "right": "left",
    "leftmost": "rightmost",
    "rightmost": "leftmost",
}
_SIDE = re.compile(rf"\b({'|'.join(_OPPOSITE_SIDE)})\b(?! (?:by|next))")
"""A word for a side; *right by the button* is none."""


def exchange_sides(words: str) -> str:
    """Return words with left and right exchanged: *on the left* becomes *on the right*."""
    return _SIDE.sub(lambda found: _OPPOSITE_SIDE[found[0]], words)


def mirrored_objects(episode: Episode, instruction: Instruction) -> Mapping[str, frozenset[str]]:
    """Return which objects the instruction would mean to a listener who takes left for right.

    *The cube on the left* means the red cube and, with left and right exchanged, the blue one:
    ``{"cube_red": {"cube_blue"}}``. Where the goal counts cubes, a place only gives their color, so
    all cubes of a color stand for one another. No object is given that the instruction means as
    well.

    Returns:
        For the name of each object that is meant, those that the exchanged words single out; empty
        if no place names left or right, or the exchanged place is not clear.
    """
    metadata: Mapping[str, Any] = instruction.metadata
    if not metadata["landmarks"]:
        return {}
    (place,) = metadata["landmarks"]  # words such as "all the way on the left"
    kind = get_task(episode.task).things.pointed
    thing_by_phrase = things_at(episode.scene, kind, metadata["frame"])
    meant = thing_by_phrase.get(place)
    exchanged = thing_by_phrase.get(exchange_sides(place))
    if meant is None or exchanged is None:
        return {}
    meant_names = _exchangeable(episode, meant)
    mirrored_names = _exchangeable(episode, exchanged) - meant_names
    if not mirrored_names:
        return {}
    return dict.fromkeys(meant_names, mirrored_names)


def _exchangeable(episode: Episode, thing: SceneObject) -> frozenset[str]:
    """Return the names of what stands for a thing in the goal.

    For a container the cube under it; for a cube itself, or, where the goal counts cubes, all cubes
    of its color.
    """
    if "counts" not in episode.goal.as_mapping():
        return frozenset([thing.inside or thing.name])
    same_kind = episode.scene.of_kind(thing.kind)
    return frozenset(item.name for item in same_kind if item.color == thing.color)
