"""Pictures of scenes with free labels, kept in files."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import partial
from pathlib import Path

import cv2
import msgspec
import numpy as np
from numpy.typing import NDArray

from roboirg.extension.commands import InvalidValueError, parallel_map, write_atomically
from roboirg.extension.episodes import ENVIRONMENT_VERSION, Episode
from roboirg.extension.sight import (
    LabeledView,
    decode_png,
    labeled_views,
    shown_to_policy,
)

LATER_STEP = 40
"""Control step of a second look at scenes with a video: the containers have appeared by then."""
Pixels = NDArray[np.uint8]
_StoredViews = list[tuple[bytes, tuple[str, ...], list[list[float]], list[list[float]]]]
"""Views in a file: fields as in `LabeledView`, the picture as PNG."""
NO_PICTURE: Pixels = np.zeros((0, 0, 3), np.uint8)
"""Stands for the picture where only labels were asked for."""


look = partial(labeled_views, later=LATER_STEP)
"""Returns labeled pictures of an episode's start; of one with a video, also a later one."""


def pictures_to_see(first: Pixels, frames: Sequence[Pixels] | Pixels, every: int) -> list[Pixels]:
    """Return the pictures that a listener looks at.

    Of a video, its first frame and the one at `LATER_STEP`, or the last one; without a video, the
    first picture of the policy's turn.

    Args:
        first: that picture.
        frames: of the video, up to that step; may be empty.
        every: control steps between two frames.
    """
    if not len(frames):
        return [first]
    return [frames[0], frames[min(LATER_STEP // every, len(frames) - 1)]]


def look_as_played(episode: Episode) -> tuple[LabeledView, ...]:
    """Return the pictures that a listener looks at when it plays an episode; without labels."""
    seen = pictures_to_see(*shown_to_policy(episode, LATER_STEP), LATER_STEP)
    return tuple(LabeledView(one, (), _points_of([]), _points_of([])) for one in seen)


def draw_missing(
    folder: Path,
    episodes: Sequence[Episode],
    draw: Callable[[Episode], tuple[LabeledView, ...]],
    workers: int,
    show: Callable[[int, int], object],
) -> None:
    """Draw the views of episodes that a folder does not have, by `look` or `look_as_played`."""
    folder.mkdir(parents=True, exist_ok=True)
    missing = [one for one in episodes if not _path(folder, one).exists()]
    there = len(episodes) - len(missing)
    for done, _ in enumerate(parallel_map(partial(_store, folder, draw), missing, workers), 1):
        show(there + done, len(episodes))


def read_views(folder: Path, episode: Episode, *, pictures: bool) -> tuple[LabeledView, ...]:
    """Return the views of an episode from a folder, or only their labels."""
    path = _path(folder, episode)
    try:
        stored = msgspec.msgpack.decode(path.read_bytes(), type=_StoredViews)
    except (OSError, msgspec.DecodeError) as error:
        raise InvalidValueError(f"{str(path)!r} cannot be read ({error}); delete it.") from error
    return tuple(
        LabeledView(decode_png(png) if pictures else NO_PICTURE, names, *map(_points_of, points))
        for png, names, *points in stored
    )


def _path(folder: Path, episode: Episode) -> Path:
    return folder / f"{episode.key.replace('/', '-')}-{ENVIRONMENT_VERSION}.views"


def _store(
    folder: Path, draw: Callable[[Episode], tuple[LabeledView, ...]], episode: Episode
) -> None:
    stored = []
    for picture, names, *points in draw(episode):
        png = cv2.imencode(".png", picture[..., ::-1])[1].tobytes()
        stored.append((png, names, *(one.tolist() for one in points)))
    write_atomically(_path(folder, episode), msgspec.msgpack.encode(stored))


def _points_of(points: Sequence[Sequence[float]]) -> NDArray[np.float32]:
    return np.array(points, dtype=np.float32).reshape(-1, 2)
