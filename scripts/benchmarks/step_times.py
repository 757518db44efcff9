"""Seconds per control step on a stretch of a real episode, with the oracle's actions."""

from __future__ import annotations

import functools
import gc
import itertools
import statistics
import time
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from roboirg.core.episode import Episode
from roboirg.core.observations import CAMERAS
from roboirg.simulation.cameras import Cameras
from roboirg.simulation.episode_session import EpisodeSession
from roboirg.simulation.expert.primitives import MotionPrimitives
from roboirg.simulation.rendering.render_settings import FAITHFUL, STOCK, RenderSettings
from roboirg.tasks.splits.splits import get_episode

Action = NDArray[np.float64]

STEPS = 48
"""Timed control steps of a stretch."""
CHUNK = 16
"""Control steps per picture pair of a policy that acts in chunks."""


@dataclass(frozen=True)
class Workload:
    """A stretch of an episode.

    Attributes:
        episode: the episode.
        before: untimed actions (n, 8) that lead to the stretch.
        actions: timed actions (`STEPS`, 8).
    """

    episode: Episode
    before: NDArray[np.float64]
    actions: NDArray[np.float64]

    def start(
        self, *, visible: bool = True, rendering: RenderSettings = FAITHFUL
    ) -> EpisodeSession:
        """Return the episode, played up to the stretch."""
        session = EpisodeSession(self.episode, visible=visible, rendering=rendering)
        for action in self.before:
            session.step(action)
        return session


def over_the_table() -> Workload:
    """Return a stretch in which the arm moves from home to above a cube, in the background."""
    return stretch("PickXtimes", 2, first=4)


@functools.cache
def stretch(task: str, index: int, first: int) -> Workload:
    """Play the first stages, of the demonstration or the policy, and cut out a stretch."""
    episode = get_episode(task, "test", index)
    session = EpisodeSession(episode, visible=False)
    end = first + STEPS
    actions = []
    for trajectory in _trajectories(episode, session):
        for action in trajectory:
            session.step(action)
            actions.append(action)
        if len(actions) >= end:
            break
    return Workload(episode, np.stack(actions[:first]), np.stack(actions[first:end]))


def _trajectories(episode: Episode, session: EpisodeSession) -> Iterator[Iterable[Action]]:
    """Yield the actions of each motion of the expert; the next is planned from where it ends."""
    expert = MotionPrimitives(session.world)
    for stage in (*episode.demonstration, *episode.stages):
        yield from expert.execute(stage.primitive)


def eager_step(workload: Workload, rendering: RenderSettings = FAITHFUL) -> float:
    """Time steps with both pictures after every step."""
    return _drawn_step(workload, rendering, lambda cameras: cameras.pictures(CAMERAS))


def stock_step(workload: Workload) -> float:
    """Time steps as in RoboMME: draw everything, fetch color and segmentation at every step."""
    return _drawn_step(workload, STOCK, draw_as_stock)


def _drawn_step(
    workload: Workload, rendering: RenderSettings, draw: Callable[[Cameras], object]
) -> float:
    session = workload.start(rendering=rendering)
    session.world.cameras.pictures(CAMERAS)

    def step(action: Action) -> None:
        session.step(action)
        draw(session.world.cameras)

    return median_time(workload, step)


def lazy_step(workload: Workload) -> float:
    """Time steps with both pictures after every chunk."""
    session = workload.start()
    session.world.cameras.pictures(CAMERAS)
    numbers = itertools.count(1)

    def step(action: Action) -> None:
        session.step(action)
        if next(numbers) % CHUNK == 0:
            session.world.cameras.pictures(CAMERAS)

    return median_time(workload, step, CHUNK)


def draw_as_stock(cameras: Cameras) -> None:
    """Fetch color and segmentation of both cameras."""
    cameras.pictures(CAMERAS)
    for camera in CAMERAS:
        cameras.segmentation(camera)


def median_time(workload: Workload, step: Callable[[Action], object], group: int = 1) -> float:
    """Return seconds per step: the median over groups of steps, robust against hiccups."""
    gc.collect()  # left by an earlier measurement
    durations = []
    for first in range(0, STEPS, group):
        start = time.perf_counter()
        for action in workload.actions[first : first + group]:
            step(action)
        durations.append((time.perf_counter() - start) / group)
    return statistics.median(durations)
