"""Steps per second of vector environments with one sub-environment for each core."""

from __future__ import annotations

import os
import time
from collections.abc import Callable, Sequence
from functools import partial
from multiprocessing.connection import Connection
from typing import Any

import numpy as np
from gymnasium.vector import AsyncVectorEnv
from numpy.typing import NDArray

from roboirg.apps.bench.step_times import CHUNK, STEPS, Workload, over_the_table
from roboirg.core.errors import RoboIRGError
from roboirg.envs.environment import RoboIRGEnv
from roboirg.envs.factory import make, make_vec
from roboirg.util.child_process import ChildProcess

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
    workload = over_the_table()
    children = [ChildProcess.spawn(_work, workload) for _ in range(cores())]
    try:
        _expect(children, "ready")
        start = time.perf_counter()
        for child in children:
            child.send("go")
        _expect(children, "done")
        seconds = time.perf_counter() - start
    finally:
        for child in children:
            child.close()
    return cores() * _ROUNDS * STEPS / seconds


def _expect(children: Sequence[ChildProcess], word: str) -> None:
    """Wait for a word from each child."""
    for child in children:
        said = child.receive()
        if said != word:
            raise RoboIRGError(f"A process that was to be measured was lost: {said}.")


def _work(connection: Connection, workload: Workload) -> None:
    env: RoboIRGEnv = make(workload.episode.task, episode=workload.episode.index)
    env.reset()
    env.step_chunk(workload.before)
    connection.send("ready")
    connection.recv()
    for _ in range(_ROUNDS):
        for chunk in _chunks(workload):
            env.step_chunk(chunk)
    connection.send("done")


def _chunks(workload: Workload) -> list[NDArray[Any]]:
    return [workload.actions[first : first + CHUNK] for first in range(0, STEPS, CHUNK)]


def _rate(run: Callable[[], None]) -> float:
    start = time.perf_counter()
    for _ in range(_ROUNDS):
        run()
    return cores() * _ROUNDS * STEPS / (time.perf_counter() - start)
