"""Startup time and memory of a process, and what two of them reach together."""

from __future__ import annotations

import json
import os
import subprocess
import sys
import time

import numpy as np

from roboirg.apps.bench.probe_process import Path
from roboirg.util.parallel_map import parallel_map


def process_start(path: Path) -> float:
    """Return seconds from the start of a process to its first observation."""
    start = time.perf_counter()
    _in_process(path, "first")
    return time.perf_counter() - start


def next_episode(path: Path) -> float:
    """Return seconds for another episode without a video in the same process.

    On the stock path it costs as much as the first one after the imports: SAPIEN frees its render
    engine with the last scene, so a new environment creates it again.
    """
    return _in_process(path, "next")["seconds"]


def process_memory() -> float:
    """Return the peak memory of a process that plays and draws both cameras, GiB."""
    return _in_process("ours", "memory")["gibibytes"]


def numeric_rate(processes: int) -> float:
    """Return how often a second several processes together carry out plain numeric work."""
    start = time.monotonic() + _LEAD_S
    counts = parallel_map(_count, [start] * processes, processes)
    return sum(count for _, count in counts) / _COUNTED_S


_LEAD_S, _COUNTED_S = 3.0, 3.0
_NO_BYTECODE = "PYTHONDONTWRITEBYTECODE"


def _count(start: float) -> int:
    """Work from a moment on, and return how often."""
    matrix, count = np.eye(64), 0
    time.sleep(max(start - time.monotonic(), 0.0))
    while time.monotonic() < start + _COUNTED_S:
        for _ in range(20):
            matrix = np.roll(matrix, 1, axis=0) * 0.5 + 0.5
        count += 1
    return count


def _in_process(path: Path, what: str) -> dict[str, float]:
    command = [sys.executable, "-m", "roboirg.apps.bench.probe_process", path, what]
    # With cached bytecode, as for an installed package.
    variables = {key: value for key, value in os.environ.items() if key != _NO_BYTECODE}
    done = subprocess.run(  # noqa: S603
        command, check=True, capture_output=True, text=True, env=variables
    )
    results: dict[str, float] = json.loads(done.stdout)
    return results
