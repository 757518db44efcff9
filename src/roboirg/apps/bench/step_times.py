"""Seconds per control step: with pictures, without pictures, and physics alone."""

from __future__ import annotations

import gc
import statistics
import time
from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from roboirg.apps.bench.workloads import STEPS, Workload
from roboirg.core.observations import CAMERAS
from roboirg.simulation.rendering.render_settings import FAITHFUL, STOCK, RenderSettings

Action = NDArray[np.float64]

CHUNK = 16
"""Control steps per picture pair of a policy that acts in chunks."""


def eager_step(workload: Workload, rendering: RenderSettings = FAITHFUL) -> float:
    """Time steps with both pictures after every step."""
    return _with_pictures(workload, rendering, every=1)


def lazy_step(workload: Workload, rendering: RenderSettings = FAITHFUL) -> float:
    """Time steps with both pictures after every chunk."""
    return _with_pictures(workload, rendering, every=CHUNK)


def stock_step(workload: Workload) -> float:
    """Time steps as in RoboMME: draw everything, fetch color and segmentation at every step."""
    session = workload.start(rendering=STOCK)
    cameras = session.world.cameras
    cameras.pictures(CAMERAS)

    def step(action: Action) -> None:
        session.step(action)
        cameras.pictures(CAMERAS)
        for camera in CAMERAS:
            cameras.segmentation(camera)

    return _median(workload, step)


def floor_step(workload: Workload) -> float:
    """Time physics and pictures of what is visible, without rules, words or observations."""
    world = workload.start().world
    world.cameras.pictures(CAMERAS)

    def step(action: Action) -> None:
        world.advance(action)
        world.cameras.pictures(CAMERAS)

    return _median(workload, step)


def undrawn_step(workload: Workload) -> float:
    """Time physics and rules."""
    return _median(workload, workload.start(visible=False).step, CHUNK)


def physics_step(workload: Workload) -> float:
    """Time physics alone."""
    return _median(workload, workload.start(visible=False).world.advance, CHUNK)


def _with_pictures(workload: Workload, rendering: RenderSettings, every: int) -> float:
    session = workload.start(rendering=rendering)
    cameras = session.world.cameras
    cameras.pictures(CAMERAS)
    count = 0

    def step(action: Action) -> None:
        nonlocal count
        session.step(action)
        count += 1
        if count % every == 0:
            cameras.pictures(CAMERAS)

    return _median(workload, step, every)


def _median(workload: Workload, step: Callable[[Action], object], group: int = 1) -> float:
    """Return seconds per step: the median over groups of steps, robust against hiccups."""
    gc.collect()  # left by an earlier measurement
    durations = []
    for first in range(0, STEPS, group):
        start = time.perf_counter()
        for action in workload.actions[first : first + group]:
            step(action)
        durations.append((time.perf_counter() - start) / group)
    return statistics.median(durations)
