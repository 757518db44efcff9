"""Reset time of an episode with a video, with or without reading its frames."""

from __future__ import annotations

import os
import tempfile
import time
from collections.abc import Iterator
from contextlib import contextmanager

from roboirg.core.episode import Episode
from roboirg.core.observations import CAMERAS
from roboirg.envs.factory import make
from roboirg.simulation.episode_session import EpisodeSession
from roboirg.simulation.rendering.render_settings import STOCK
from roboirg.tasks.splits.splits import get_episode
from roboirg.util.cache import FOLDER_VARIABLE, OFF


def video_episode() -> Episode:
    """Return an episode with a video of medium length: VideoRepick, hard, 150 frames."""
    return get_episode("VideoRepick", "test", 3)


def stock_reset(episode: Episode) -> float:
    """Return the time of a reset as in RoboMME: plan, draw, and fetch color and segmentation."""
    start = time.perf_counter()
    session = EpisodeSession(episode, visible=True, rendering=STOCK)
    cameras = session.world.cameras

    def draw(_stage: object) -> None:
        cameras.pictures(CAMERAS)
        for camera in CAMERAS:
            cameras.segmentation(camera)

    session.play_demonstration(draw)
    return time.perf_counter() - start


def cold_reset(episode: Episode, *, frames: bool) -> float:
    """Return the time of a reset without a cache, with or without reading the frames."""
    with _cache(OFF):
        return _reset(episode, frames=frames)


def warm_reset(episode: Episode, *, frames: bool) -> float:
    """Return the time of a reset with everything cached by an earlier one."""
    with tempfile.TemporaryDirectory() as folder, _cache(folder):
        _reset(episode, frames=frames)
        return _reset(episode, frames=frames)


def _reset(episode: Episode, *, frames: bool) -> float:
    start = time.perf_counter()
    env = make(episode)
    _, info = env.reset()
    if frames:
        video = info["demonstration"]
        video.draw()
        for camera in CAMERAS:
            video[f"{camera}_rgb"].sum()
    return time.perf_counter() - start


@contextmanager
def _cache(folder: str) -> Iterator[None]:
    """Use another cache within the context."""
    before = os.environ.get(FOLDER_VARIABLE)
    os.environ[FOLDER_VARIABLE] = folder
    try:
        yield
    finally:
        if before is None:
            del os.environ[FOLDER_VARIABLE]
        else:
            os.environ[FOLDER_VARIABLE] = before
