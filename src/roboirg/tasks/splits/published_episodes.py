"""RoboMME's published episodes: its seeds, difficulties, scenes and goals, shipped as data.

``published.jsonl.gz`` has a line for each episode, made by ``scripts/convert_robomme_episodes.py``
from the poses and draws of a running RoboMME (Apache-2.0, see NOTICE). Of the 2,200 episodes six
did not build on that machine; they are not in the file, and our samplers fill their places.
"""

from __future__ import annotations

import functools
import gzip
import hashlib
import json
from collections.abc import Mapping
from importlib import resources
from typing import NamedTuple, cast

import msgspec

from roboirg.core.episode import Difficulty, Goal, Scene
from roboirg.core.errors import RoboIRGError
from roboirg.tasks.splits.scene_codec import decode

FILE = "published.jsonl.gz"
SHA256 = "300e3420a23a54f5d77be1eee8d1cf9b103a8b864333100cdd69d1643268de83"
"""Of the file's text, before compression."""


class PublishedEpisode(NamedTuple):
    """One of RoboMME's episodes.

    Attributes:
        seed: RoboMME's.
        difficulty: RoboMME's.
        scene: objects, motions and what the video shows.
        goal: what is wanted.
    """

    seed: int
    difficulty: Difficulty
    scene: Scene
    goal: Goal


def published_episode(task: str, split: str, index: int) -> PublishedEpisode | None:
    """Return an episode that RoboMME has published, or None if it has none of that number.

    None means for the caller: sample the episode instead.
    """
    line = _lines().get(_Key(task, split, index))
    if line is None:
        return None
    entry = json.loads(line)
    return PublishedEpisode(
        seed=entry["seed"],
        difficulty=entry["difficulty"],
        scene=cast("Scene", decode(entry["scene"])),
        goal=cast("Goal", decode(entry["goal"])),
    )


def published_goals(task: str) -> tuple[Goal, ...]:
    """Return the goals of all published episodes of a task, in the order of the file.

    Equal goals are repeated, one for each episode.
    """
    lines = (line for key, line in _lines().items() if key.task == task)
    return tuple(cast("Goal", decode(json.loads(line)["goal"])) for line in lines)


def published_text() -> str:
    """Return the text of the shipped file, one JSON object a line.

    Raises:
        RoboIRGError: the file's hash is another one: it is damaged.
    """
    packed = resources.files("roboirg.tasks.splits").joinpath(FILE).read_bytes()
    text = gzip.decompress(packed).decode()
    found = hashlib.sha256(text.encode()).hexdigest()
    if found != SHA256:
        raise RoboIRGError(
            f"The shipped file {FILE} is damaged: its SHA-256 is {found}, it should be {SHA256}; "
            "install the package again."
        )
    return text


class _Key(msgspec.Struct, frozen=True):
    """Which episode a line has."""

    task: str
    split: str
    index: int


@functools.cache
def _lines() -> Mapping[_Key, str]:
    """Return the lines; a line is decoded when it is asked for."""
    lines = published_text().splitlines()
    return {msgspec.json.decode(line, type=_Key): line for line in lines}
