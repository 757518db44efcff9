"""Supervised worker process that plays one job after the other.

The supervisor gets exactly one record for each job within bounded time: the worker's own; an error
that names the phase in which the worker died; or, if a policy call or the whole episode exceeds its
limit, a timeout error after the worker has been killed.
"""

from __future__ import annotations

import contextlib
import functools
import os
import time
from collections.abc import Iterator
from dataclasses import dataclass
from multiprocessing.connection import Connection, wait
from typing import NamedTuple, cast

from roboirg.core.errors import EndOfRunError, RoboIRGError
from roboirg.evaluation.hosting.host_pool import Connect
from roboirg.evaluation.play.episode_record import lost_record, utc_now
from roboirg.evaluation.play.rollout import EpisodeRunner, PlayJob
from roboirg.evaluation.play.watchdog import Phase, Watchdog, use_watchdog, watched
from roboirg.evaluation.records.episode_log import log_path, logged_output
from roboirg.evaluation.records.record import ErrorKind, Job, Record
from roboirg.util.child_process import ChildExit, ChildProcess, serve

MAX_FAILED_STARTS = 3
"""Consecutive failed starts, for each worker, after which the run stops."""

POLL_S = 0.25
"""How often a supervisor checks deadlines."""

_FATAL_ERRORS = {error.__name__: error for error in EndOfRunError.__subclasses__()}


class _FatalError(NamedTuple):
    """An error that ends the run, as a worker sends it."""

    kind: str
    message: str


@dataclass
class Worker:
    """A worker process and its current job.

    Attributes:
        child: plays the jobs; its channel is readable when there is a record or it has died.
        watchdog: current phase of the process.
        job: the current job.
        started: when the job was assigned, seconds of the monotonic clock.
        started_at: the same for records.
    """

    child: ChildProcess
    watchdog: Watchdog
    job: Job
    started: float = 0.0
    started_at: str = ""

    @classmethod
    def start(
        cls,
        play: PlayJob,
        job: Job,
        connect: Connect | None = None,
        *,
        limit_threads: bool = False,
    ) -> Worker:
        """Start a process and assign its first job.

        Args:
            play: plays one job.
            job: the first job.
            connect: returns the process's line to the policy hosts; None if it needs none.
            limit_threads: render with one thread, because every core has its own process.
        """
        watchdog = Watchdog()
        with connected(play, connect) as hosted:
            child = ChildProcess.spawn(_work, watchdog, hosted, limit_threads)
        worker = cls(child, watchdog, job)
        worker.assign(job)
        return worker

    def assign(self, job: Job) -> None:
        """Send the next job to an idle worker."""
        self.job, self.started, self.started_at = job, time.monotonic(), utc_now()
        self.watchdog.begin_job()
        self.child.send(job)

    def receive(self) -> Record:
        """Return the record of the job once the connection is readable.

        The worker may be dead afterwards.

        Raises:
            RoboIRGError: an error that would end every other job too (no Vulkan device, …).
        """
        reply = self.child.receive()
        if isinstance(reply, ChildExit):
            return self._error_record(*_explain_exit(self.watchdog.phase, reply))
        if isinstance(reply, _FatalError):
            raise _FATAL_ERRORS.get(reply.kind, RoboIRGError)(reply.message)
        if not isinstance(reply, Record):
            raise TypeError(f"a worker sent {type(reply).__name__}, not a Record")
        return reply

    def kill_if_overdue(self, episode_timeout_s: float) -> Record | None:
        """Kill the process and return an error record if its job has exceeded a time limit."""
        if self.watchdog.is_overdue:
            message = f"the {self.watchdog.phase} did not return within {self.watchdog.limit_s:g} s"
        elif time.monotonic() - self.started - self.watchdog.queued_s > episode_timeout_s:
            message = (
                f"the episode took longer than {episode_timeout_s:g} s "
                f"(now in the {self.watchdog.phase})"
            )
        else:
            return None
        if self.watchdog.awaited:
            message += f", waiting for {self.watchdog.awaited}"
        self.child.end()
        return self._error_record("timeout", message)

    @property
    def is_dead(self) -> bool:
        """Whether the process has died or been killed."""
        return self.child.connection.closed

    @property
    def failed_to_start(self) -> bool:
        """Whether the process died before it played anything."""
        return self.is_dead and self.watchdog.phase == "worker startup"

    def _error_record(self, kind: ErrorKind, message: str) -> Record:
        record = lost_record(self.job, kind, message)
        record.started_at = self.started_at
        record.duration_s = round(time.monotonic() - self.started, 3)
        return record


class WorkerSlot:
    """Plays one job after the other in a supervised process, replaced when it dies.

    Args:
        play: plays one job.
        episode_timeout_s: how long an episode may take.
        connect: returns a process's line to the policy hosts; None if it needs none.
    """

    def __init__(
        self, play: PlayJob, episode_timeout_s: float, connect: Connect | None = None
    ) -> None:
        self._play, self._episode_timeout_s, self._connect = play, episode_timeout_s, connect
        self._worker: Worker | None = None

    def play(self, job: Job) -> Record:
        """Play a job; the process is kept for the next one.

        Raises:
            RoboIRGError: an error that would end every other job too (no Vulkan device, …).
        """
        if self._worker is None:
            self._worker = Worker.start(self._play, job, self._connect, limit_threads=True)
        else:
            self._worker.assign(job)
        worker, record = self._worker, None
        while record is None:
            if wait([worker.child.connection], POLL_S):
                record = worker.receive()
            else:
                record = worker.kill_if_overdue(self._episode_timeout_s)
        if worker.is_dead:
            self._worker = None
        return record

    @property
    def queued_s(self) -> float:
        """Seconds that the current job has waited for its turn."""
        return 0.0 if self._worker is None else self._worker.watchdog.queued_s


@contextlib.contextmanager
def connected(play: PlayJob, connect: Connect | None) -> Iterator[PlayJob]:
    """Yield what plays jobs, with a line of its own to the policy hosts, closed here at the end."""
    if connect is None:
        yield play
        return
    with connect() as line:
        yield cast("EpisodeRunner", play).with_hosts(line)


def _explain_exit(phase: Phase, ended: ChildExit) -> tuple[ErrorKind, str]:
    """Return the kind of error and the message for a process that died."""
    kind: ErrorKind = "policy" if phase.startswith("policy") else "environment"
    return "infrastructure" if ended.was_killed else kind, f"{ended} in the {phase}"


def _work(connection: Connection, watchdog: Watchdog, play: PlayJob, limit_threads: bool) -> None:
    """Play jobs from the connection until it is closed; runs in the worker process."""
    use_watchdog(watchdog)
    if limit_threads:
        # lavapipe reads this when it is loaded, which is later.
        os.environ.setdefault("LP_NUM_THREADS", "1")
    serve(connection, functools.partial(_play, play))


def _play(play: PlayJob, job: Job) -> Record | _FatalError:
    try:
        with watched("environment"), _logged(play, job):
            return play(job)
    except RoboIRGError as error:
        return _FatalError(type(error).__name__, str(error))


def _logged(play: PlayJob, job: Job) -> contextlib.AbstractContextManager[None]:
    """Send what is printed during a job to its log, if the run has a folder."""
    if isinstance(play, EpisodeRunner):
        return logged_output(log_path(play.folder, job.slug))
    return contextlib.nullcontext()
