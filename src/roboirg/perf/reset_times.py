"""Seconds until an episode with a video can be played, with its frames or without."""

from __future__ import annotations

import os
import tempfile
import time
from collections.abc import Iterator
from contextlib import contextmanager

from roboirg.core.episode import Episode
from roboirg.core.observations import CAMERAS
from roboirg.envs.factory import make
from roboirg.episodes.splits import get_episode
from roboirg.simulation.episode_session import EpisodeSession
from roboirg.simulation.rendering.render_settings import STOCK
from roboirg.util.cache import FOLDER_VARIABLE, OFF


def video_episode() -> Episode:
    """An episode whose video is neither long nor short: VideoRepick, hard, 150 frames."""
    return get_episode("VideoRepick", "test", 3)


def stock_reset(episode: Episode) -> float:
    """What RoboMME does: planned and drawn at every reset, color and segmentation fetched."""
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
    """Nothing is cached; the video's frames are read, or left alone."""
    with _cache(OFF):
        return _reset(episode, frames=frames)


def warm_reset(episode: Episode, *, frames: bool) -> float:
    """The demonstration, and its frames if they are read, have been kept by an earlier reset."""
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
    """Another cache for a while."""
    before = os.environ.get(FOLDER_VARIABLE)
    os.environ[FOLDER_VARIABLE] = folder
    try:
        yield
    finally:
        if before is None:
            del os.environ[FOLDER_VARIABLE]
        else:
            os.environ[FOLDER_VARIABLE] = before
