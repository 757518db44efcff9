"""Processes: how long they take to start, how much they hold, how many are worth having."""

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
    """From the start of a process to its first observation, s."""
    start = time.perf_counter()
    _in_process(path, "first")
    return time.perf_counter() - start


def next_episode(path: Path) -> float:
    """Another episode without a video, in a process that has played one, s.

    On the stock path it costs what the first one does after the imports: with its last scene SAPIEN
    frees its render engine, so a new environment pays for it anew.
    """
    return _in_process(path, "next")["seconds"]


def process_memory() -> float:
    """What a process holds at most that plays and looks at both cameras, GiB."""
    return _in_process("ours", "process_memory")["gibibytes"]


def throughput(workers: int) -> float:
    """Steps with both pictures per second of so many processes together."""
    context = multiprocessing.get_context("spawn")
    barrier = context.Barrier(workers + 1)
    team = [context.Process(target=_work, args=(barrier,)) for _ in range(workers)]
    for worker in team:
        worker.start()
    barrier.wait()
    start = time.perf_counter()
    barrier.wait()
    seconds = time.perf_counter() - start
    for worker in team:
        worker.join()
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
    # As an installed package, with what Python has compiled before.
    variables = {key: value for key, value in os.environ.items() if key != _NO_BYTECODE}
    done = subprocess.run(  # noqa: S603
        command, check=True, capture_output=True, text=True, env=variables
    )
    told: dict[str, float] = json.loads(done.stdout)
    return told
