"""What is shown and seen of an episode: its video, the first picture, and masks of objects.

Pictures and videos of a dataset are each stored once, under a hash of their content.
"""

from __future__ import annotations

import contextlib
import hashlib
from fractions import Fraction
from pathlib import Path
from typing import NamedTuple

import numpy as np

from roboirg.apps.grounding.items.grounding_item import Mask, PointTarget, encode_mask
from roboirg.apps.grounding.items.referents import find_referents
from roboirg.core.episode import Episode
from roboirg.core.errors import RoboIRGError
from roboirg.core.observations import FRONT
from roboirg.envs.environment import RoboIRGEnv
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

PICTURES = "pictures"
VIDEOS = "videos"
NAME_DIGITS = 24


class EpisodeMedia(NamedTuple):
    """Pictures of an episode by the front camera, and where the things that are meant are seen.

    Attributes:
        picture: path of the picture at the start of the policy's turn.
        video: path of the video; None without one.
        frames: paths of frames of the video, evenly spaced.
        steps: control steps of the video.
        points: one for each thing that is meant.
    """

    picture: str
    video: str | None
    frames: tuple[str, ...]
    steps: int
    points: tuple[PointTarget, ...]


def store_media(folder: Path, episode: Episode, every: int, most: int) -> EpisodeMedia:
    """Store the first picture of an episode, and the video before it if it has one.

    Files are named by their content, so equal ones are stored once.

    Args:
        folder: of the dataset.
        episode: the episode.
        every: control steps between two frames of the video.
        most: how many frames of the video are stored as pictures, too, at most.

    Raises:
        RoboIRGError: a thing that is meant cannot be seen, or the video cannot be played.
        InvalidValueError: the folder cannot be written.
    """
    env = RoboIRGEnv(episode, cameras=(FRONT,), demonstration_frames=every)
    with contextlib.closing(env):
        observation, info = env.reset()
        points = _points(env, episode)
    shown = info["demonstration"]
    picture = encode_png(Picture(observation["front_rgb"]))
    media = EpisodeMedia(
        picture=store_content(folder, PICTURES, picture, ".png"),
        video=None,
        frames=(),
        steps=shown.length,
        points=points,
    )
    if not shown.length:
        return media
    clip = Clip(shown["front_rgb"], Fraction(CONTROL_RATE, every))
    video = store_content(folder, VIDEOS, encode_mp4(clip), ".mp4")
    return media._replace(video=video, frames=_store_frames(folder, clip, most))


def _store_frames(folder: Path, clip: Clip, most: int) -> tuple[str, ...]:
    """Store some frames of a video, evenly spaced, as pictures; return their paths."""
    pictures = [encode_jpeg(pixels) for pixels in sample_evenly(clip.frames, most)]
    return tuple(store_content(folder, PICTURES, picture, ".jpg") for picture in pictures)


def _points(env: RoboIRGEnv, episode: Episode) -> tuple[PointTarget, ...]:
    """Return where the things that the instruction means are seen in the first picture.

    Each has a pixel and a mask. A thing may be several objects that are equally right, such as all
    red cubes; its mask has the pixels of all.

    Raises:
        RoboIRGError: one of them cannot be seen.
    """
    world = env.session.world
    segments = world.cameras.segmentation(FRONT)
    found = []
    for referent in find_referents(episode):
        # `segments`, shape (height, width), has in each pixel the number of the body seen there.
        numbers = [world.bodies[name].segment for name in referent.objects]
        mask = np.isin(segments, numbers)
        if not mask.any():
            raise RoboIRGError(
                f"{episode.key}: {' and '.join(referent.objects)} cannot be seen in the first "
                "picture."
            )
        found.append(_target(referent.kind, mask))
    return tuple(found)


def store_content(folder: Path, kind: str, content: bytes, suffix: str) -> str:
    """Store a file under a hash of its content, so that equal files are stored once.

    Args:
        folder: of the dataset.
        kind: folder in it, such as ``pictures``.
        content: of the file.
        suffix: of its name, such as ``.png``.

    Returns:
        The path in the dataset: ``pictures/3f9c….png``.
    """
    name = hashlib.sha256(content).hexdigest()[:NAME_DIGITS]
    path = folder / kind / f"{name}{suffix}"
    if not path.exists():
        write_atomically(path, content)
    return f"{kind}/{path.name}"


def _target(kind: str, mask: Mask) -> PointTarget:
    """Return the place of a thing: its mask, and one pixel of it near its middle."""
    y, x = nearest_to_center(mask)
    height, width = mask.shape
    return PointTarget(kind=kind, x=x, y=y, size=(height, width), counts=encode_mask(mask))


def nearest_to_center(mask: Mask) -> tuple[int, int]:
    """Return row and column of the pixel of a mask that is nearest to the mean of all of them.

    The mean itself may lie outside the mask, as in a ring. The mask must not be empty.
    """
    places = np.argwhere(mask)
    distances = np.square(places - places.mean(axis=0)).sum(axis=1)
    row, column = places[int(distances.argmin())]
    return int(row), int(column)
