"""Pictures and videos of a dataset, each stored once under a hash of its content."""

from __future__ import annotations

import hashlib
from fractions import Fraction
from pathlib import Path

from roboirg.core.episode import Episode
from roboirg.evaluation.grounding_items.item_builder import EpisodeMedia
from roboirg.evaluation.grounding_items.seen_scene import SeenScene, look_at_episode
from roboirg.util.atomic_write import write_atomically
from roboirg.util.media import (
    CONTROL_RATE,
    Clip,
    Picture,
    encode_jpeg,
    encode_mp4,
    encode_png,
    sample_evenly,
)

PICTURES, VIDEOS = "pictures", "videos"
NAME_DIGITS = 24


def store_media(folder: Path, episode: Episode, every: int, most: int) -> EpisodeMedia:
    """Take the pictures of an episode and store them.

    Args:
        folder: of the dataset.
        episode: the episode.
        every: control steps between two frames of the video.
        most: maximum of the frames that are stored as pictures, too.

    Raises:
        RoboIRGError: a thing that is meant cannot be seen, or the video cannot be played.
        InvalidValueError: the folder cannot be written.
    """
    seen = look_at_episode(episode, every)
    return EpisodeMedia(
        picture=store_content(folder, PICTURES, encode_png(Picture(seen.picture)), ".png"),
        video=_store_video(folder, seen, every),
        frames=tuple(
            store_content(folder, PICTURES, encode_jpeg(pixels), ".jpg")
            for pixels in sample_evenly(seen.frames, most)
        ),
        steps=seen.steps,
        points=seen.points,
        meters=seen.meters,
    )


def store_content(folder: Path, kind: str, content: bytes, suffix: str) -> str:
    """Store a file under a name that follows from its content; return its path in the dataset."""
    name = hashlib.sha256(content).hexdigest()[:NAME_DIGITS]
    path = folder / kind / f"{name}{suffix}"
    if not path.exists():
        write_atomically(path, content)
    return f"{kind}/{path.name}"


def _store_video(folder: Path, seen: SeenScene, every: int) -> str | None:
    if not seen.steps:
        return None
    clip = Clip(seen.frames, Fraction(CONTROL_RATE, every))
    return store_content(folder, VIDEOS, encode_mp4(clip), ".mp4")
