"""Steps per second of Gymnasium's `AsyncVectorEnv` with one sub-environment for each core."""

from __future__ import annotations

import os
import time
from typing import Any

import gymnasium
import numpy as np
from gymnasium.vector import AsyncVectorEnv
from numpy.typing import NDArray

from benchmarks.step_times import CHUNK, STEPS, over_the_table
from roboirg.envs.action_chunks import ActionChunks
from roboirg.envs.factory import make

_ROUNDS = 5
"""How often the stretch is repeated."""


def cores() -> int:
    """Return the number of sub-environments."""
    return os.cpu_count() or 1


def vector_rate(length: int = CHUNK) -> float:
    """Return the steps per second with chunks of a length, for each of which both cameras draw."""
    workload = over_the_table()

    def make_one() -> gymnasium.Env[Any, Any]:
        env = make(workload.episode.task, episode=workload.episode.index)
        return ActionChunks(env, length)

    vector = AsyncVectorEnv([make_one] * cores(), context="spawn")
    first = np.repeat(workload.before[:1], -len(workload.before) % length, axis=0)
    vector.reset()
    _play(vector, np.concatenate([first, workload.before]), length)
    start = time.perf_counter()
    for _ in range(_ROUNDS):
        _play(vector, workload.actions, length)
    seconds = time.perf_counter() - start
    vector.close()
    return cores() * _ROUNDS * STEPS / seconds


def _play(vector: AsyncVectorEnv, rows: NDArray[Any], length: int) -> None:
    for chunk in rows.reshape(-1, length, rows.shape[1]):
        vector.step(np.stack([chunk] * cores()))
