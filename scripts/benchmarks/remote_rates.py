"""Steps per second of a policy that replies at once: in process, over loopback, and hosted."""

from __future__ import annotations

import atexit
import functools
import os
import statistics
import subprocess
import sys
import time

from benchmarks.step_times import CHUNK
from benchmarks.worker_rates import WavingPolicy
from roboirg.core.observations import CAMERAS
from roboirg.core.policy_needs import PolicyNeeds
from roboirg.envs.factory import make
from roboirg.policies import Policy, make_policy, play
from roboirg.policies.by_name.finding import read_policy
from roboirg.runs.hosting.host_pool import HostPool, HostSettings
from roboirg.runs.hosting.hosted_policy import HostedPolicy

CHUNKS = 12
EPISODES = 7
POLICY = f"{__name__}:BothCameras"


class BothCameras(WavingPolicy):
    """Looks at both pictures."""

    cameras = CAMERAS


def in_process() -> float:
    """Return steps per second without a server."""
    return steps_per_second(make_policy(POLICY, 0))


def over_loopback() -> float:
    """Return steps per second with the same policy in a server process, over openpi's protocol."""
    return steps_per_second(make_policy(_server(), 0))


def hosted() -> float:
    """Return steps per second with the same policy in a process of its own."""
    with HostPool(HostSettings()) as pool:
        policy = HostedPolicy(pool.connect(), read_policy(POLICY), 0)
        try:
            return steps_per_second(policy)
        finally:
            policy.close()


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
    command = (sys.executable, "-m", "roboirg", "serve", POLICY)
    child = subprocess.Popen(  # noqa: S603 - our own command
        [*command, "--protocol", "openpi", "--port", "0"],
        stdout=subprocess.PIPE,
        text=True,
        env={**os.environ, "PYTHONPATH": os.pathsep.join(filter(None, sys.path))},
    )
    atexit.register(child.kill)
    if child.stdout is None:
        raise AssertionError("stdout is a pipe")
    address = child.stdout.readline().partition(" at ")[2].partition(";")[0]
    return f"{address}?execute={CHUNK}"
