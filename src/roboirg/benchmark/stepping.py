"""Seconds per control step, with pictures, without, and with nothing but physics."""

from __future__ import annotations

import time

from roboirg.benchmark.workloads import STEPS, Workload
from roboirg.observations import CAMERAS
from roboirg.simulation.rendering import FAITHFUL, STOCK, Rendering

CHUNK = 16
"""Control steps per picture pair of a policy that acts in chunks."""


def eager(workload: Workload, rendering: Rendering = FAITHFUL) -> float:
    """Both pictures after every step."""
    return _with_pictures(workload, rendering, every=1)


def lazy(workload: Workload, rendering: Rendering = FAITHFUL) -> float:
    """Both pictures after every chunk."""
    return _with_pictures(workload, rendering, every=CHUNK)


def stock(workload: Workload) -> float:
    """What RoboMME does: everything drawn at every step, colour and segmentation fetched."""
    session = workload.begun(rendering=STOCK)
    cameras = session.world.cameras
    cameras.pictures(CAMERAS)
    start = time.perf_counter()
    for action in workload.actions:
        session.step(action)
        cameras.pictures(CAMERAS)
        for camera in CAMERAS:
            cameras.segmentation(camera)
    return (time.perf_counter() - start) / STEPS


def floor(workload: Workload) -> float:
    """Physics and the pictures of what is visible, without rules, words or observations."""
    world = workload.begun().world
    world.cameras.pictures(CAMERAS)
    start = time.perf_counter()
    for action in workload.actions:
        world.advance(action)
        world.cameras.pictures(CAMERAS)
    return (time.perf_counter() - start) / STEPS


def without_pictures(workload: Workload) -> float:
    """Physics and rules."""
    session = workload.begun(visible=False)
    start = time.perf_counter()
    for action in workload.actions:
        session.step(action)
    return (time.perf_counter() - start) / STEPS


def physics(workload: Workload) -> float:
    """Physics alone."""
    world = workload.begun(visible=False).world
    start = time.perf_counter()
    for action in workload.actions:
        world.advance(action)
    return (time.perf_counter() - start) / STEPS


def _with_pictures(workload: Workload, rendering: Rendering, every: int) -> float:
    session = workload.begun(rendering=rendering)
    cameras = session.world.cameras
    cameras.pictures(CAMERAS)
    start = time.perf_counter()
    for number, action in enumerate(workload.actions, start=1):
        session.step(action)
        if number % every == 0:
            cameras.pictures(CAMERAS)
    return (time.perf_counter() - start) / STEPS
