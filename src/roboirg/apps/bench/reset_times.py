"""Reset time of an episode with a video."""

from __future__ import annotations

import os
import time
from collections.abc import Iterator
from contextlib import contextmanager

from roboirg.apps.bench.step_times import draw_as_stock
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
    session.play_demonstration(lambda _stage: draw_as_stock(session.world.cameras))
    return time.perf_counter() - start


def cold_reset(episode: Episode, *, frames: bool = True) -> float:
    """Return the time of a reset without a cache, with or without reading the frames."""
    with cache_folder(OFF):
        return reset_time(episode, frames=frames)


def reset_time(episode: Episode, *, frames: bool) -> float:
    """Return the time of a reset, with or without reading the frames of the video."""
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
def cache_folder(folder: str) -> Iterator[None]:
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
