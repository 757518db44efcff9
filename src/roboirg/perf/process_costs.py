"""Startup time, memory and throughput of processes."""

from __future__ import annotations

import json
import multiprocessing
import os
import subprocess
import sys
import time
from multiprocessing.synchronize import Barrier

from roboirg.perf import step_times
from roboirg.perf.probe_process import Path
from roboirg.perf.workloads import STEPS, over_the_table


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


def throughput(workers: int) -> float:
    """Return the total steps per second, with both pictures, of several processes."""
    context = multiprocessing.get_context("spawn")
    barrier = context.Barrier(workers + 1)
    processes = [context.Process(target=_work, args=(barrier,)) for _ in range(workers)]
    for process in processes:
        process.start()
    barrier.wait()
    start = time.perf_counter()
    barrier.wait()
    seconds = time.perf_counter() - start
    for process in processes:
        process.join()
    return workers * _ROUNDS * STEPS / seconds


_ROUNDS = 3
_NO_BYTECODE = "PYTHONDONTWRITEBYTECODE"


def _work(barrier: Barrier) -> None:
    workload = over_the_table()
    step_times.eager_step(workload)
    barrier.wait()
    for _ in range(_ROUNDS):
        step_times.eager_step(workload)
    barrier.wait()


def _in_process(path: Path, what: str) -> dict[str, float]:
    command = [sys.executable, "-m", "roboirg.perf.probe_process", path, what]
    # With cached bytecode, as for an installed package.
    variables = {key: value for key, value in os.environ.items() if key != _NO_BYTECODE}
    done = subprocess.run(  # noqa: S603
        command, check=True, capture_output=True, text=True, env=variables
    )
    results: dict[str, float] = json.loads(done.stdout)
    return results
