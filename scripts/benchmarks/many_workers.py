"""What bounds many workers: a policy that takes its time, and the processor cores."""

from __future__ import annotations

import time
from collections.abc import Sequence
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from roboirg.apps.bench.worker_rates import WavingPolicy
from roboirg.core.observations import FRONT, Demonstration, Observation
from roboirg.util.parallel_map import parallel_map

CALL_S = 0.05
"""How long a call of the slow policy takes, whatever the number of episodes."""
_LEAD_S, _COUNTED_S = 3.0, 3.0


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


def numeric_rate(processes: int) -> float:
    """Return how often a second several processes together carry out plain numeric work."""
    start = time.monotonic() + _LEAD_S
    counts = parallel_map(_count, [start] * processes, processes)
    return sum(count for _, count in counts) / _COUNTED_S


def _count(start: float) -> int:
    """Work from a moment on, and return how often."""
    matrix, count = np.eye(64), 0
    time.sleep(max(start - time.monotonic(), 0.0))
    while time.monotonic() < start + _COUNTED_S:
        for _ in range(20):
            matrix = np.roll(matrix, 1, axis=0) * 0.5 + 0.5
        count += 1
    return count
