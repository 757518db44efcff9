"""Executors: play jobs in this process or in worker processes.

An executor takes jobs from a queue, plays them with a function, and yields one record for each in
the order in which they finish. Storing records is the caller's task, and so is retrying errors: it
puts jobs back into the queue. To write your own, implement `Executor`;
`roboirg.runs.run.ray_cluster` is one for many machines.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Generator, Iterable
from dataclasses import dataclass
from multiprocessing.connection import wait
from typing import Protocol

from roboirg.core.errors import RoboIRGError
from roboirg.records.record import Job, Record
from roboirg.runs.hosting.host_pool import open_hosts
from roboirg.runs.play.rollout import PlayJob
from roboirg.runs.run.workers import MAX_FAILED_STARTS, POLL_S, Worker, connected
from roboirg.util.processor import core_count, worker_count

NO_TIMEOUT_S = float("inf")

Records = Generator[Record, None, None]
"""Yields records; unlike those of an iterator, its end can be brought about: it can be closed."""

Warn = Callable[[str], None]
"""Shows a sentence that the user should read now."""


class Executor(Protocol):
    """Interface of an executor."""

    def run(self, jobs: deque[Job], play: PlayJob, warn: Warn, /) -> Records:
        """Yield one record for each job as they finish; closing the generator stops the rest.

        Args:
            jobs: the jobs, from which the caller may remove some, and to which it may add some
                whenever it has got a record.
            play: plays one job.
            warn: shows what the user should know of the machines.

        Raises:
            RoboIRGError: an error that would end every other job too (no Vulkan device, …).
        """


@dataclass(frozen=True, slots=True)
class InProcess:
    """Plays one job after the other in this process, for debugging.

    There is no supervisor: a crash ends the run, and a hanging call is never ended.
    """

    def run(self, jobs: deque[Job], play: PlayJob, _warn: Warn = print, /) -> Records:
        """Yield one record for each job, in order."""
        with open_hosts(play) as connect, connected(play, connect) as hosted:
            while jobs:
                yield hosted(jobs.popleft())


@dataclass(frozen=True, slots=True)
class LocalProcesses:
    """Plays jobs in worker processes on this machine.

    If a worker dies (segmentation fault, out of memory) or hangs, its job gets an error record, the
    worker is replaced, and the others go on. Workers exit with their parent, however it dies.

    Args:
        workers: most worker processes at a time, at least 1.
        episode_timeout_s: how long an episode may take.
    """

    workers: int
    episode_timeout_s: float = NO_TIMEOUT_S

    def run(self, jobs: deque[Job], play: PlayJob, _warn: Warn = print, /) -> Records:
        """Play jobs in worker processes, and yield one record for each job as they finish.

        Each worker plays one job after the other until none is left; one that dies is replaced
        while there are jobs. When the generator is closed, all workers are killed.

        Args:
            jobs: the queue; the caller may change it meanwhile.
            play: plays one job, in a worker.

        Raises:
            RoboIRGError: no worker can start, or an error would end every other job too.
        """
        failed_starts = 0  # in a row
        # With a process on every core, more threads in Mesa would not help.
        limit_threads = self.workers >= core_count()
        active: list[Worker] = []
        released = []
        with open_hosts(play) as connect:
            try:
                while jobs or active:
                    while jobs and len(active) < self.workers:
                        job = take_job(jobs, active)
                        active.append(Worker(play, job, connect, limit_threads=limit_threads))
                    wait([worker.child.connection for worker in active], POLL_S)
                    for worker in tuple(active):
                        record = worker.poll(self.episode_timeout_s)
                        if record is None:
                            continue
                        # A stillborn worker died before it played anything.
                        failed_starts = failed_starts + 1 if worker.is_stillborn else 0
                        if failed_starts >= MAX_FAILED_STARTS * self.workers:
                            raise RoboIRGError(f"No worker process can start ({record.cause}).")
                        active.remove(worker)
                        if not worker.is_dead and jobs:
                            worker.assign(take_job(jobs, active))
                            active.append(worker)
                        elif not worker.is_dead:
                            released.append(worker)
                            worker.child.connection.close()  # nothing is left: it may exit
                        yield record
            finally:
                for worker in active:
                    worker.child.kill()
                for worker in (*active, *released):
                    worker.child.close()


def take_job(jobs: deque[Job], others: Iterable[Worker]) -> Job:
    """Remove a job from the queue for a worker, and return it.

    It is the first job of the next policy whose scene no other worker plays now: workers keep the
    demonstration of a scene, so two of them would plan and draw the same one. If there is none, it
    is the first job of all.

    Args:
        jobs: the queue, not empty; the jobs of a scene are next to each other.
        others: all workers but the one that the job is for.
    """
    policy = jobs[0].policy
    played_scenes = {_scene_of(worker.job) for worker in others}
    chosen = 0
    for place, job in enumerate(jobs):
        if job.policy != policy:  # policies play one after the other
            break
        if _scene_of(job) not in played_scenes:
            chosen = place
            break
    job = jobs[chosen]
    del jobs[chosen]
    return job


def _scene_of(job: Job) -> tuple[str, str, str, int]:
    """Return what the jobs of a policy in one scene have in common."""
    return job.policy, job.task, job.split, job.episode


def choose_executor(
    workers: int | None = None, episode_timeout_s: float = NO_TIMEOUT_S
) -> Executor:
    """Return the executor for a number of workers as typed, see `worker_count`.

    Raises:
        InvalidValueError: a negative number.
    """
    count = worker_count(workers)
    return LocalProcesses(count, episode_timeout_s) if count else InProcess()
