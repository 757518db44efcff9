"""Episodes as JSON lines, for people who build on the scenes."""

from __future__ import annotations

import json
from collections.abc import Iterable
from pathlib import Path

from roboirg.core.episode import Episode, SceneObject
from roboirg.tasks.splits.scene_codec import Json, encode
from roboirg.util.atomic_write import write_atomically


def episode_row(episode: Episode) -> dict[str, Json]:
    """Return an episode as JSON values, one line of an exported file.

    Positions are meters in the world frame, angles radians, steps 1/20 s. `motions` and `past` name
    their type; fields with their default value are left out there.
    """
    scene = episode.scene
    return {
        "task": episode.task,
        "split": episode.split,
        "episode": episode.index,
        "seed": episode.seed,
        "difficulty": episode.difficulty,
        "objects": [_object_row(item, episode) for item in scene.objects],
        "motions": [encode(motion) for motion in scene.motions],
        "past": [encode(fact) for fact in scene.past],
        "goal": {slot: encode(value) for slot, value in episode.goal.slots},
    }


def write_episodes(episodes: Iterable[Episode], path: Path) -> int:
    """Write one line of JSON for each episode, and return their number.

    The file appears whole or not at all.
    """
    rows = [episode_row(episode) for episode in episodes]
    lines = [json.dumps(row, separators=(",", ":")) + "\n" for row in rows]
    write_atomically(path, "".join(lines))
    return len(lines)


def _object_row(item: SceneObject, episode: Episode) -> dict[str, Json]:
    """Return an object as JSON values; ``hides`` is the cube that a container stands over."""
    hidden = episode.scene.hidden_in(item.name)
    return {
        "name": item.name,
        "kind": item.kind,
        "position": encode(tuple(item.position)),
        "yaw": encode(item.yaw),
        "color": item.color,
        "hides": None if hidden is None else hidden.name,
        "radius": item.radius,
        "rgb": encode(item.rgb),
    }
