"""How many steps a second a policy plays that answers at once, in process and over loopback."""

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
from roboirg.policies.requirements import wanted_cameras

CHUNK = 16
CHUNKS = 12
EPISODES = 7
SWING = 0.2
"""Radians."""


class WavingPolicy:
    """Swings the arm to and fro, so that every picture has to be drawn; decides nothing."""

    cameras: ClassVar[tuple[str, ...]] = CAMERAS
    version = "1"

    def __init__(self) -> None:
        self._start: NDArray[np.floating[Any]] | None = None
        self._step = 0

    def reset(self, instruction: str, demonstration: Demonstration) -> None:
        """Begin to swing from wherever the arm is."""
        del instruction, demonstration
        self._start, self._step = None, 0

    def act(self, observation: Observation) -> NDArray[np.floating[Any]]:
        """The next sixteen actions."""
        if self._start is None:
            self._start = np.array(observation["joint_positions"], np.float64)
        steps = np.arange(self._step + 1, self._step + CHUNK + 1)
        self._step += CHUNK
        rows = np.tile(np.append(self._start, 1.0), (CHUNK, 1))
        rows[:, 0] += SWING * np.sin(steps / CHUNK)
        return rows


def in_process() -> float:
    """Steps a second without a server."""
    return _rate(make_policy(f"{__name__}:WavingPolicy", 0))


def over_loopback() -> float:
    """Steps a second with the same policy behind openpi's protocol, in a process of its own."""
    return _rate(make_policy(_server(), 0))


def _rate(policy: Policy) -> float:
    """The median over some episodes, which a hiccup does not move."""
    env = make(
        "PickXtimes",
        cameras=wanted_cameras(policy),
        demonstration_frames="none",
        max_steps=CHUNK * CHUNKS,
    )
    env.reset()  # what only the first episode costs
    rates = []
    for _ in range(EPISODES):
        start = time.perf_counter()
        info = play(env, policy)
        rates.append(float(info["steps"]) / (time.perf_counter() - start))
    return statistics.median(rates)


@functools.cache
def _server() -> str:
    """The address of a server that lives as long as this process."""
    command = (
        "from roboirg.policies.serving.policy_server import open_server; "
        f"server = open_server('{__name__}:WavingPolicy', 'openpi'); "
        "print(server.url, flush=True); server.listening.serve_forever()"
    )
    child = subprocess.Popen(  # noqa: S603 - this very package
        [sys.executable, "-c", command], stdout=subprocess.PIPE, text=True
    )
    atexit.register(child.kill)
    if child.stdout is None:
        raise AssertionError("it was asked for above")
    return f"{child.stdout.readline().strip()}?execute={CHUNK}"
