"""Steps per second of a policy that answers at once, in process and over loopback."""

from __future__ import annotations

import atexit
import functools
import statistics
import subprocess
import sys
import time
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from roboirg.core.observations import CAMERAS, Demonstration, Observation
from roboirg.envs.factory import make
from roboirg.policies import Policy, make_policy, play
from roboirg.policies.contract.policy_needs import PolicyNeeds

CHUNK = 16
CHUNKS = 12
EPISODES = 7
SWING = 0.2
"""Radians."""


class WavingPolicy:
    """Swings the arm back and forth, so that every picture must be drawn."""

    cameras: ClassVar[tuple[str, ...]] = CAMERAS
    version = "1"

    def __init__(self) -> None:
        self._start: NDArray[np.floating[Any]] | None = None
        self._step = 0

    def reset(self, instruction: str, demonstration: Demonstration) -> None:
        """Restart the swing from the arm's current position."""
        del instruction, demonstration
        self._start, self._step = None, 0

    def act(self, observation: Observation) -> NDArray[np.floating[Any]]:
        """Return the next sixteen actions."""
        if self._start is None:
            self._start = np.array(observation["joint_positions"], np.float64)
        steps = np.arange(self._step + 1, self._step + CHUNK + 1)
        self._step += CHUNK
        rows = np.tile(np.append(self._start, 1.0), (CHUNK, 1))
        rows[:, 0] += SWING * np.sin(steps / CHUNK)
        return rows


def in_process() -> float:
    """Return steps per second without a server."""
    return steps_per_second(make_policy(f"{__name__}:WavingPolicy", 0))


def over_loopback() -> float:
    """Return steps per second with the same policy in a server process, over openpi's protocol."""
    return steps_per_second(make_policy(_server(), 0))


def steps_per_second(policy: Policy) -> float:
    """Return a policy's median rate over some episodes, which is robust against hiccups."""
    env = make(
        "PickXtimes",
        cameras=PolicyNeeds.of(policy).cameras,
        demonstration_frames="none",
        max_steps=CHUNK * CHUNKS,
    )
    env.reset()  # costs only the first episode has
    rates = []
    for _ in range(EPISODES):
        start = time.perf_counter()
        info = play(env, policy)
        rates.append(float(info["steps"]) / (time.perf_counter() - start))
    return statistics.median(rates)


@functools.cache
def _server() -> str:
    """Start a server that lives as long as this process; returns its address."""
    command = (sys.executable, "-m", "roboirg", "serve", f"{__name__}:WavingPolicy")
    child = subprocess.Popen(  # noqa: S603 - our own command
        [*command, "--protocol", "openpi", "--port", "0"], stdout=subprocess.PIPE, text=True
    )
    atexit.register(child.kill)
    if child.stdout is None:
        raise AssertionError("stdout is a pipe")
    address = child.stdout.readline().partition(" at ")[2].partition(";")[0]
    return f"{address}?execute={CHUNK}"
