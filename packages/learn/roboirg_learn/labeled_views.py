"""Front pictures of scenes with labels, kept in files.

A view is a picture with the objects in it, by class, point and position, which the simulator knows.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import partial
from pathlib import Path
from typing import NamedTuple

import cv2
import msgspec
import numpy as np
from numpy.typing import NDArray

from roboirg.extension.commands import InvalidValueError, write_atomically
from roboirg.extension.episodes import ENVIRONMENT_VERSION, Episode
from roboirg.extension.sight import (
    LabeledView,
    decode_png,
    labeled_views,
    shown_to_policy,
)
from roboirg_learn.learn_support import make_missing_files

LATER_STEP = 40
"""Control step of a second look at scenes with a video: the containers have appeared by then."""
Pixels = NDArray[np.uint8]


class _StoredView(NamedTuple):
    """A view as MessagePack stores it: fields as in `LabeledView`, the picture as PNG."""

    png: bytes
    names: tuple[str, ...]
    centers: list[list[float]]
    positions: list[list[float]]


NO_PICTURE: Pixels = np.zeros((0, 0, 3), np.uint8)
"""Stands for the picture where only labels were asked for."""


views_at_start = partial(labeled_views, later=LATER_STEP)
"""Returns labeled front pictures of an episode: its first one; with a video, also a later one."""


def pictures_to_see(first: Pixels, frames: Sequence[Pixels] | Pixels, every: int) -> list[Pixels]:
    """Return the one or two front pictures that a listener looks at.

    Of a video, its first frame and the one at control step `LATER_STEP`, or else the last one;
    without a video, `first` alone.

    Args:
        first: the first picture after the instruction, when it is the policy's turn.
        frames: of the video, up to that step or longer; may be empty.
        every: control steps between two frames.
    """
    if not len(frames):
        return [first]
    later = min(LATER_STEP // every, len(frames) - 1)
    return [frames[0], frames[later]]


def views_as_played(episode: Episode) -> tuple[LabeledView, ...]:
    """Return what a listener looks at when it plays an episode, as views without labels."""
    first, frames = shown_to_policy(episode, LATER_STEP)
    pictures = pictures_to_see(first, frames, LATER_STEP)
    no_points = _points_of([])
    return tuple(LabeledView(picture, (), no_points, no_points) for picture in pictures)


def draw_missing(
    folder: Path,
    episodes: Sequence[Episode],
    draw: Callable[[Episode], tuple[LabeledView, ...]],
    workers: int,
    show: Callable[[int, int], object],
) -> None:
    """Render the views of those episodes that a folder does not have, and store them there.

    Args:
        folder: of the files, one for each episode.
        episodes: all of them.
        draw: `views_at_start`, with labels, or `views_as_played`, without.
        workers: processes that render; 0 uses this one.
        show: called after each episode with how many are done, and how many there are.
    """
    folder.mkdir(parents=True, exist_ok=True)
    store = partial(_store, folder, draw)
    make_missing_files(episodes, partial(_path, folder), store, workers, show)


def read_views(folder: Path, episode: Episode, *, pictures: bool) -> tuple[LabeledView, ...]:
    """Return the views of an episode from a folder.

    Args:
        folder: to which `draw_missing` wrote them.
        episode: of which they are.
        pictures: whether to decode the pictures; else only the labels are loaded.

    Raises:
        InvalidValueError: the file cannot be read.
    """
    path = _path(folder, episode)
    try:
        stored = msgspec.msgpack.decode(path.read_bytes(), type=list[_StoredView])
    except (OSError, msgspec.DecodeError) as error:
        raise InvalidValueError(f"{str(path)!r} cannot be read ({error}); delete it.") from error
    return tuple(_loaded(view, pictures=pictures) for view in stored)


def _loaded(view: _StoredView, *, pictures: bool) -> LabeledView:
    """Return a view of a file, with its picture or without."""
    picture = decode_png(view.png) if pictures else NO_PICTURE
    return LabeledView(picture, view.names, _points_of(view.centers), _points_of(view.positions))


def _path(folder: Path, episode: Episode) -> Path:
    """Return the file of an episode's views, whose name has all that they depend on.

    For example ``PickXtimes-train-0-1.views``, with the environment's version at the end.
    """
    return folder / f"{episode.key.replace('/', '-')}-{ENVIRONMENT_VERSION}.views"


def _store(
    folder: Path, draw: Callable[[Episode], tuple[LabeledView, ...]], episode: Episode
) -> None:
    """Render the views of an episode and write them to its file; `read_views` reads it.

    Runs in worker processes.

    Args:
        folder: of the files.
        draw: returns the views of an episode.
        episode: to render.
    """
    stored = []
    for view in draw(episode):
        _, png = cv2.imencode(".png", view.picture[..., ::-1])  # blue first, as OpenCV has it
        centers = view.centers.tolist()
        stored.append(_StoredView(png.tobytes(), view.names, centers, view.positions.tolist()))
    write_atomically(_path(folder, episode), msgspec.msgpack.encode(stored))


def _points_of(points: Sequence[Sequence[float]]) -> NDArray[np.float32]:
    """Return points as (n, 2), also without any."""
    return np.array(points, dtype=np.float32).reshape(-1, 2)
