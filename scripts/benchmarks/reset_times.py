"""Reset time of an episode with a video."""

from __future__ import annotations

import os
import tempfile
import time
from unittest.mock import patch

from benchmarks.step_times import draw_as_stock
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
    with patch.dict(os.environ, {FOLDER_VARIABLE: OFF}):
        return _reset_time(episode, frames=frames)


def warm_reset(episode: Episode) -> float:
    """Return the time of a reset with everything cached by an earlier one."""
    with (
        tempfile.TemporaryDirectory() as folder,
        patch.dict(os.environ, {FOLDER_VARIABLE: folder}),
    ):
        _reset_time(episode, frames=True)
        return _reset_time(episode, frames=True)


def _reset_time(episode: Episode, *, frames: bool) -> float:
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
