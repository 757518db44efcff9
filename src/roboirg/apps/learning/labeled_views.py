"""Pictures of scenes with free labels: the segmentation says what is where; kept in files."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import partial
from pathlib import Path
from typing import NamedTuple

import msgspec
import numpy as np
from numpy.typing import NDArray

from roboirg.core.episode import ENVIRONMENT_VERSION, Episode, SceneObject
from roboirg.core.errors import InvalidValueError
from roboirg.core.observations import FRONT
from roboirg.envs.environment import RoboIRGEnv
from roboirg.simulation.episode_session import EpisodeSession
from roboirg.simulation.physics_settings import HOME_ACTION
from roboirg.util.atomic_write import write_atomically
from roboirg.util.media import Picture, Pixels, decode_png, encode_png
from roboirg.util.parallel_map import parallel_map

LATER_STEP = 40
"""Control step of a second look at scenes with a video: the containers have appeared by then."""
MIN_PIXELS = 12
"""Objects of which fewer pixels are visible are not labeled."""
_StoredViews = list[tuple[bytes, tuple[str, ...], list[list[float]], list[list[float]]]]
"""Views in a file: fields as in `LabeledView`, the picture as PNG."""
NO_PICTURE: Pixels = np.zeros((0, 0, 3), np.uint8)


class LabeledView(NamedTuple):
    """A picture with the centers of its objects.

    Attributes:
        picture: uint8 (256, 256, 3); empty where only the labels were asked for.
        names: of the objects' classes, such as ``cube red``.
        centers: (n, 2), column and row of the mean of the visible pixels.
        positions: (n, 2), x and y on the table, m.
    """

    picture: Pixels
    names: tuple[str, ...]
    centers: NDArray[np.float32]
    positions: NDArray[np.float32]


def class_of(item: SceneObject) -> str:
    """Return the class of an object that a picture can show: its kind and color."""
    return " ".join(filter(None, (item.kind.removeprefix("hidden_"), item.color)))


def look(episode: Episode) -> tuple[LabeledView, ...]:
    """Return labeled pictures of an episode's start; of one with a video, also a later one."""
    session = EpisodeSession(episode, visible=True)
    # What comes later leaves the table with the first step, before anything is shown.
    session.world.step(HOME_ACTION)
    views = [_view(session, episode.scene.objects)]
    if episode.demonstration:
        while session.world.elapsed <= LATER_STEP:
            session.world.step(HOME_ACTION)
        views.append(_view(session, episode.scene.objects))
    return tuple(views)


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
    env = RoboIRGEnv(episode, cameras=(FRONT,), demonstration_frames=LATER_STEP)
    try:
        observation, info = env.reset()
        video = info["demonstration"]
        frames = video[f"{FRONT}_rgb"] if video.length else ()
        seen = pictures_to_see(observation[f"{FRONT}_rgb"], frames, LATER_STEP)
        return tuple(LabeledView(one, (), _points_of(()), _points_of(())) for one in seen)
    finally:
        env.close()


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
    stored = [
        (encode_png(Picture(picture)), names, centers.tolist(), positions.tolist())
        for picture, names, centers, positions in draw(episode)
    ]
    write_atomically(_path(folder, episode), msgspec.msgpack.encode(stored))


def _view(session: EpisodeSession, objects: Sequence[SceneObject]) -> LabeledView:
    world = session.world
    segments = world.cameras.segmentation(FRONT)
    names, centers, positions = [], [], []
    for item in objects:
        rows, columns = np.nonzero(segments == world.bodies[item.name].segment)
        if len(rows) >= MIN_PIXELS:
            names.append(class_of(item))
            centers.append((columns.mean(), rows.mean()))
            positions.append(world.bodies[item.name].position[:2])
    return LabeledView(
        world.picture(FRONT), tuple(names), _points_of(centers), _points_of(positions)
    )


def _points_of(points: Sequence[Sequence[float]]) -> NDArray[np.float32]:
    return np.array(points, dtype=np.float32).reshape(-1, 2)
