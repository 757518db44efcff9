"""Where jobs are played: in this process, or in processes beside it.

An executor gets jobs and a way to play them and yields one record for each, in the order in
which they end. It stores nothing and tries nothing again: the caller does. Whoever writes another
one implements `Executor` and nothing else; `roboirg.evaluation.executors.ray_cluster` is one for
many machines.
"""

from __future__ import annotations

import os
from collections import deque
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from multiprocessing.connection import wait
from typing import Protocol

from roboirg.core.errors import InvalidValueError, RoboIRGError
from roboirg.evaluation.executors.workers import MAX_FAILED_STARTS, POLL_S, Worker
from roboirg.evaluation.rollout import PlayJob
from roboirg.records.record import Job, Record

NO_TIMEOUT_S = float("inf")


class Executor(Protocol):
    """Plays jobs somewhere."""

    def run(self, jobs: Sequence[Job], play: PlayJob) -> Iterator[Record]:
        """Yield one record for each job, as they end; closing the iterator stops the rest.

        Raises:
            RoboIRGError: what would end every other job too (no Vulkan device, …).
        """


@dataclass(frozen=True, slots=True)
class InProcess:
    """Plays one job after the other right here: for debuggers.

    Nobody supervises it: a crash takes all with it, and what hangs, hangs.
    """

    def run(self, jobs: Sequence[Job], play: PlayJob) -> Iterator[Record]:
        """Yield one record for each job, in their order."""
        yield from map(play, jobs)


@dataclass(frozen=True, slots=True)
class LocalProcesses:
    """Plays jobs in processes of this machine that live as long as there is work.

    A process that dies (segmentation fault, out of memory) or hangs costs its job an error, is
    replaced, and the others go on. The processes die with the one that made them, however it dies.

    Args:
        workers: how many at most, at least 1.
        episode_timeout_s: how long an episode may take.

    Raises:
        InvalidValueError: fewer than one worker.
    """

    workers: int
    episode_timeout_s: float = NO_TIMEOUT_S

    def __post_init__(self) -> None:
        if self.workers < 1:
            raise InvalidValueError(f"workers is {self.workers}; it must be at least 1.")

    def run(self, jobs: Sequence[Job], play: PlayJob) -> Iterator[Record]:
        """Yield one record for each job, as they end.

        Raises:
            RoboIRGError: no process can start, or whatever would end every other job too.
        """
        waiting, stillborn = deque(jobs), 0
        # With a process on every core, Mesa's own threads would only take turns.
        crowded = self.workers >= core_count()
        crew: list[Worker] = []
        retired: list[Worker] = []
        try:
            while waiting or crew:
                while waiting and len(crew) < self.workers:
                    crew.append(Worker.hire(play, waiting.popleft(), crowded=crowded))
                for worker, record in self._ended(crew):
                    stillborn = stillborn + 1 if worker.is_stillborn else 0
                    if stillborn >= MAX_FAILED_STARTS * self.workers:
                        raise RoboIRGError(f"No worker process can start ({record.cause}).")
                    if worker.is_gone:
                        crew.remove(worker)
                    elif waiting:
                        worker.assign(waiting.popleft())
                    else:
                        crew.remove(worker)
                        retired.append(worker)
                        worker.dismiss()
                    yield record
        finally:
            for worker in crew:
                worker.stop()
            for worker in (*crew, *retired):
                worker.bury()

    def _ended(self, crew: list[Worker]) -> Iterator[tuple[Worker, Record]]:
        """Wait a moment; every worker whose job has ended, one way or another."""
        ready = wait([worker.connection for worker in crew], POLL_S)
        for worker in tuple(crew):
            if worker.connection in ready:
                yield worker, worker.receive()
            elif (record := worker.overdue(self.episode_timeout_s)) is not None:
                yield worker, record


def choose_executor(workers: int | None, episode_timeout_s: float = NO_TIMEOUT_S) -> Executor:
    """The executor for a number of workers: None for one per core, 0 for this process.

    Raises:
        InvalidValueError: a negative number.
    """
    if workers == 0:
        return InProcess()
    return LocalProcesses(core_count() if workers is None else workers, episode_timeout_s)


def core_count() -> int:
    """How many cores this process may use."""
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1
