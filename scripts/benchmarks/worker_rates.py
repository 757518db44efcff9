"""Episodes an hour, or steps a second, of workers that share one policy process."""

from __future__ import annotations

import tempfile
import time
from collections import deque
from collections.abc import Sequence
from pathlib import Path
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from benchmarks.step_times import CHUNK
from roboirg.core.observations import CAMERAS, FRONT, Demonstration, Observation
from roboirg.runs.plan.plan_maker import make_plan
from roboirg.runs.play.rollout import EpisodeRunner
from roboirg.runs.run.executor import LocalProcesses

MAX_STEPS = 20 * CHUNK
FEW_STEPS = 5 * CHUNK
EPISODES = 12
"""Episodes that each worker plays, about."""
_HOUR_S = 3600
CALL_S = 0.05
"""How long a call of the slow policy takes, whatever the number of episodes."""
_SWING = 0.2
"""Radians."""


class WavingPolicy:
    """Swings the arm back and forth, so that every picture must be drawn; replies at once."""

    cameras: ClassVar[tuple[str, ...]] = (FRONT,)
    demonstration_frames = "none"
    chunk = CHUNK
    version = "1"

    def __init__(self) -> None:
        self._start: NDArray[np.floating[Any]] | None = None
        self._step = 0

    def reset(self, instruction: str, demonstration: Demonstration) -> None:
        """Restart the swing from the arm's current position."""
        del instruction, demonstration
        self._start = None
        self._step = 0

    def act(self, observation: Observation) -> NDArray[np.floating[Any]]:
        """Return the next actions."""
        if self._start is None:
            self._start = np.array(observation["joint_positions"], np.float64)
        steps = np.arange(self._step + 1, self._step + self.chunk + 1)
        self._step += self.chunk
        rows = np.tile(np.append(self._start, 1.0), (self.chunk, 1))
        rows[:, 0] += _SWING * np.sin(steps / CHUNK)
        return rows


class FrontPicture(WavingPolicy):
    """Swings the arm, and wants the front camera's picture of every step."""

    chunk = 1


class BothPictures(FrontPicture):
    """Wants both pictures of every step."""

    cameras = CAMERAS


class SlowPolicy:
    """Swings the arm, takes batches, and thinks 50 ms about each, as a model on a GPU does."""

    cameras = (FRONT,)
    demonstration_frames = "none"
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
        pairs = zip(states, observations, strict=True)
        return [state.act(observation) for state, observation in pairs]


def steps_per_second(policy: type, workers: int) -> float:
    """Return the control steps a second of all workers together, without their start."""
    return episodes_per_hour(policy, workers, FEW_STEPS) * FEW_STEPS / _HOUR_S


def episodes_per_hour(policy: type, workers: int, max_steps: int = MAX_STEPS) -> float:
    """Return the pace at which a number of workers plays a policy, without their start."""
    count = EPISODES * workers
    plan = make_plan(
        [f"{policy.__module__}:{policy.__name__}"],
        tasks="PickXtimes",
        settings="explicit",
        episodes="4",
        policy_seeds=f"0-{count // 4 - 1}",
        max_steps=max_steps,
    )
    # Without the beginning, when some workers still start, and the end, when some have no more.
    first = 4 * workers
    last = count - workers
    times = []
    with tempfile.TemporaryDirectory() as folder:
        runner = EpisodeRunner(Path(folder), hosting=plan.hosting.settings)
        for record in LocalProcesses(workers).run(deque(plan.jobs()), runner):
            times.append(time.perf_counter())
            if record.outcome == "error":
                raise RuntimeError(f"an episode ended in an error: {record.cause}")
    return _HOUR_S * (last - first) / (times[last - 1] - times[first - 1])
