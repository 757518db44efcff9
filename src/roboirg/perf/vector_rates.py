"""Steps per second of vector environments with one sub-environment for each core."""

from __future__ import annotations

import multiprocessing
import os
import time
from collections.abc import Callable
from functools import partial
from multiprocessing.synchronize import Barrier
from typing import Any

import numpy as np
from gymnasium.vector import AsyncVectorEnv
from numpy.typing import NDArray

from roboirg.envs.environment import RoboIRGEnv
from roboirg.envs.factory import make, make_vec
from roboirg.perf.step_times import CHUNK
from roboirg.perf.workloads import STEPS, Workload, over_the_table

_ROUNDS = 5
"""How often the stretch is repeated."""


def cores() -> int:
    """Return the number of sub-environments."""
    return os.cpu_count() or 1


def vector_rate() -> float:
    """Return the steps per second of our vector environment, a picture pair for each chunk."""
    workload = over_the_table()
    vector = make_vec(workload.episode.task, cores(), episode=workload.episode.index)
    vector.reset()
    vector.step_chunk([workload.before] * cores())

    def run() -> None:
        for chunk in _chunks(workload):
            vector.step_chunk([chunk] * cores())

    rate = _rate(run)
    vector.close()
    return rate


def async_rate() -> float:
    """Return that of Gymnasium's `AsyncVectorEnv`, which draws at every step."""
    workload = over_the_table()
    one = partial(make, workload.episode.task, episode=workload.episode.index)
    vector = AsyncVectorEnv([one] * cores(), context="spawn")
    vector.reset()
    for action in workload.before:
        vector.step(np.tile(action, (cores(), 1)))

    def run() -> None:
        for action in workload.actions:
            vector.step(np.tile(action, (cores(), 1)))

    rate = _rate(run)
    vector.close()
    return rate


def separate_rate() -> float:
    """Return that of as many processes with an environment each, a picture pair for each chunk."""
    context = multiprocessing.get_context("spawn")
    barrier = context.Barrier(cores() + 1)
    workload = over_the_table()
    processes = [context.Process(target=_work, args=(barrier, workload)) for _ in range(cores())]
    for process in processes:
        process.start()
    barrier.wait()
    start = time.perf_counter()
    barrier.wait()
    seconds = time.perf_counter() - start
    for process in processes:
        process.join()
    return cores() * _ROUNDS * STEPS / seconds


def _work(barrier: Barrier, workload: Workload) -> None:
    env: RoboIRGEnv = make(workload.episode.task, episode=workload.episode.index)
    env.reset()
    env.step_chunk(workload.before)
    barrier.wait()
    for _ in range(_ROUNDS):
        for chunk in _chunks(workload):
            env.step_chunk(chunk)
    barrier.wait()


def _chunks(workload: Workload) -> list[NDArray[Any]]:
    return [workload.actions[first : first + CHUNK] for first in range(0, STEPS, CHUNK)]


def _rate(run: Callable[[], None]) -> float:
    start = time.perf_counter()
    for _ in range(_ROUNDS):
        run()
    return cores() * _ROUNDS * STEPS / (time.perf_counter() - start)
