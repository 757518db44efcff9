"""Policies in a process of their own: against the world's process, and one for many worlds."""

from __future__ import annotations

import tempfile
import time
from collections.abc import Sequence
from pathlib import Path
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from roboirg.core.observations import FRONT, Demonstration, Observation
from roboirg.evaluation.executors.executor import LocalProcesses
from roboirg.evaluation.hosting.host_pool import HostPool, HostSettings
from roboirg.evaluation.hosting.hosted_policy import HostedPolicy
from roboirg.evaluation.plan import make_plan
from roboirg.evaluation.rollout import EpisodeRunner
from roboirg.perf.remote_rates import CHUNK, WavingPolicy, steps_per_second

CALL_S = 0.05
"""How long a call of the slow policy takes, whatever the number of episodes."""
MAX_STEPS = 20 * CHUNK
_HOUR_S = 3600


class SlowPolicy:
    """Swings the arm, takes batches, and thinks 50 ms about each, as a model on a GPU does."""

    cameras: ClassVar[tuple[str, ...]] = (FRONT,)
    demonstration_frames: ClassVar[str] = "none"
    version = "1"

    def begin(self, instruction: str, demonstration: Demonstration) -> WavingPolicy:
        """Return the swing of an episode."""
        state = WavingPolicy()
        state.reset(instruction, demonstration)
        return state

    def act_batch(
        self, states: Sequence[WavingPolicy], observations: Sequence[Observation]
    ) -> list[NDArray[np.floating[Any]]]:
        """Return the next sixteen actions of each episode."""
        time.sleep(CALL_S)
        return [state.act(one) for state, one in zip(states, observations, strict=True)]


def hosted() -> float:
    """Return steps per second with a policy that answers at once, in a process of its own."""
    with HostPool(HostSettings()) as pool:
        policy = HostedPolicy(pool.address, f"{WavingPolicy.__module__}:{WavingPolicy.__name__}", 0)
        try:
            return steps_per_second(policy)
        finally:
            policy.close()


def episodes_per_hour(workers: int) -> float:
    """Return the pace at which a number of workers plays one slow policy, without their start."""
    count = 12 * workers
    plan = make_plan(
        [f"{__name__}:{SlowPolicy.__name__}"],
        tasks="PickXtimes",
        settings="explicit",
        episodes="4",
        policy_seeds=f"0-{count // 4 - 1}",
        max_steps=MAX_STEPS,
    )
    with tempfile.TemporaryDirectory() as folder:
        runner = EpisodeRunner(Path(folder), hosting=plan.hosting)
        times = [time.perf_counter() for _ in LocalProcesses(workers).run(plan.jobs(), runner)]
    # Without the beginning, when some workers still start, and the end, when some have no more.
    first, last = 4 * workers, len(times) - workers
    return _HOUR_S * (last - first) / (times[last] - times[first])
