"""Processes: how long they take to start, how much they hold, how many are worth having."""

from __future__ import annotations

import json
import multiprocessing
import pathlib
import subprocess
import sys
import time
from multiprocessing.synchronize import Barrier
from typing import Literal

import roboirg
from roboirg.benchmark import stepping
from roboirg.benchmark.workloads import STEPS, over_the_table
from roboirg.observations import CAMERAS
from roboirg.simulation.rendering import FAITHFUL, STOCK
from roboirg.simulation.session import Session
from roboirg.splits import get_episode

Path = Literal["ours", "stock"]
TASK = "PickXtimes"


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


def memory() -> float:
    """What a process holds at most that plays and looks at both cameras, GiB."""
    return _in_process("ours", "memory")["gibibytes"]


def throughput(workers: int) -> float:
    """Steps with both pictures per second of so many processes together."""
    context = multiprocessing.get_context("spawn")
    barrier = context.Barrier(workers + 1)
    team = [context.Process(target=_work, args=(barrier,)) for _ in range(workers)]
    for worker in team:
        worker.start()
    barrier.wait()
    start = time.perf_counter()
    for worker in team:
        worker.join()
    return workers * _ROUNDS * STEPS / (time.perf_counter() - start)


_ROUNDS = 3


def _work(barrier: Barrier) -> None:
    workload = over_the_table()
    stepping.eager(workload)
    barrier.wait()
    for _ in range(_ROUNDS):
        stepping.eager(workload)


def _in_process(path: Path, what: str) -> dict[str, float]:
    command = [sys.executable, "-m", "roboirg.benchmark.starting", path, what]
    done = subprocess.run(command, check=True, capture_output=True, text=True)  # noqa: S603
    told: dict[str, float] = json.loads(done.stdout)
    return told


def _most_resident() -> float:
    """The most memory that this process has held, GiB.

    From Linux's status file: what `resource` tells may be the parent's before the fork.
    """
    status = pathlib.Path("/proc/self/status").read_text(encoding="ascii")
    line = next(line for line in status.splitlines() if line.startswith("VmHWM"))
    return int(line.split()[1]) / 2**20


def _observe(path: Path, index: int) -> None:
    if path == "ours":
        roboirg.make(TASK, episode=index).reset()
        return
    session = Session(get_episode(TASK, "test", index), visible=True, rendering=STOCK)
    session.play_demonstration(lambda _stage: None)
    session.world.cameras.pictures(CAMERAS)
    for camera in CAMERAS:
        session.world.cameras.segmentation(camera)


def _main(path: Path, what: str) -> None:
    told: dict[str, float] = {}
    start = time.perf_counter()
    _observe(path, 0)
    if what == "next":
        if path == "ours":
            start = time.perf_counter()
            _observe(path, 1)
        told["seconds"] = time.perf_counter() - start
    elif what == "memory":
        stepping.eager(over_the_table(), FAITHFUL)
        told["gibibytes"] = _most_resident()
    sys.stdout.write(json.dumps(told))


if __name__ == "__main__":
    _main("stock" if sys.argv[1] == "stock" else "ours", sys.argv[2])
