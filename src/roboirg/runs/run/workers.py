"""Supervised worker process that plays one job after the other.

The supervisor gets exactly one record for each job within bounded time: the worker's own; an error
that names the phase in which the worker died; or, if a policy call or the whole episode exceeds its
limit, a timeout error after the worker has been killed; so, too, if a drawing or the physics of a
control step never returns, but that is the environment's error, as a crash there is.
"""

from __future__ import annotations

import contextlib
import functools
import os
import time
from collections.abc import Iterator
from dataclasses import replace
from multiprocessing.connection import Connection
from typing import cast

from roboirg.core.errors import EndOfRunError, RoboIRGError
from roboirg.records.episode_log import log_path, logged_output
from roboirg.records.record import ErrorKind, Job, Record
from roboirg.runs.hosting.host_pool import Connect
from roboirg.runs.play.episode_record import lost_record, utc_now
from roboirg.runs.play.rollout import EpisodeRunner, PlayJob
from roboirg.runs.play.watchdog import NATIVE, Watchdog, use_watchdog, watched
from roboirg.util.child_process import ChildExit, ChildProcess, serve

MAX_FAILED_STARTS = 3
"""Consecutive failed starts, for each worker, after which the run stops."""

POLL_S = 0.25
"""How often a supervisor checks deadlines."""


class Worker:
    """A worker process and its current job.

    Args:
        play: plays one job.
        job: the first job.
        connect: returns the process's line to the policy hosts; None if it needs none.
        limit_threads: render with one thread, because every core has its own process.

    Attributes:
        child: plays the jobs; its channel is readable when there is a record or it has died.
        watchdog: current phase of the process.
        job: the current job.
        started: when the job was assigned, seconds of the monotonic clock.
        started_at: the same for records, in ISO 8601, UTC.
    """

    def __init__(
        self,
        play: PlayJob,
        job: Job,
        connect: Connect | None = None,
        *,
        limit_threads: bool = False,
    ) -> None:
        self.watchdog = Watchdog()
        with connected(play, connect) as hosted:
            self.child = ChildProcess.spawn(_work, self.watchdog, hosted, limit_threads)
        self.assign(job)

    def assign(self, job: Job) -> None:
        """Send a job to this idle worker; its time counts from now."""
        self.job = job
        self.started = time.monotonic()
        self.started_at = utc_now()
        self.watchdog.begin_job()
        self.child.send(job)

    @property
    def spent_s(self) -> float:
        """Seconds that the job has taken, without those that it waited for its turn."""
        return time.monotonic() - self.started - self.watchdog.queued_s

    def poll(self, episode_timeout_s: float, wait_s: float = 0.0) -> Record | None:
        """Return the record of the current job, or None while it goes on.

        If the process has died, or is killed now because its job exceeds a time limit, the record
        is an error.

        Args:
            episode_timeout_s: how long the job may take.
            wait_s: how long to wait for its end, seconds.

        Raises:
            RoboIRGError: an error that would end every other job too (no Vulkan device, …).
        """
        if self.child.connection.poll(wait_s):
            reply = self.child.receive()
            if isinstance(reply, RoboIRGError):
                raise reply
            if isinstance(reply, ChildExit):
                return self._exit_record(reply)
            return cast("Record", reply)

        # There is no reply yet: is a call, or the whole episode, over its limit?
        kind: ErrorKind = "timeout"
        overdue = self.watchdog.overdue
        if overdue is not None:
            message = f"the {overdue.phase} did not return within {overdue.limit_s:g} s"
            if overdue.phase in NATIVE:
                kind = "environment"
        elif self.spent_s > episode_timeout_s:
            message = (
                f"the episode took longer than {episode_timeout_s:g} s "
                f"(now in the {self.watchdog.phase})"
            )
        else:
            return None
        if self.watchdog.awaited:
            message += f", waiting for {self.watchdog.awaited}"
        self.child.end()
        return self._error_record(kind, message)

    @property
    def is_dead(self) -> bool:
        """Whether the process has died or been killed."""
        return self.child.connection.closed

    @property
    def is_stillborn(self) -> bool:
        """Whether the process died before it played anything."""
        return self.is_dead and self.watchdog.phase == "worker startup"

    def _exit_record(self, exit_: ChildExit) -> Record:
        """Return the record of a job whose process died; its phase shows whose error that is."""
        phase = self.watchdog.phase
        kind: ErrorKind = "policy" if phase.startswith("policy") else "environment"
        if exit_.was_killed:
            kind = "infrastructure"
        return self._error_record(kind, f"{exit_} in the {phase}")

    def _error_record(self, kind: ErrorKind, message: str) -> Record:
        """Return the record of an error for the current job, whose process is lost."""
        record = lost_record(self.job, kind, message)
        record.started_at = self.started_at
        record.duration_s = round(time.monotonic() - self.started, 3)
        return record


@contextlib.contextmanager
def connected(play: PlayJob, connect: Connect | None) -> Iterator[PlayJob]:
    """Yield the function that plays jobs, with a line to the policy hosts if it needs one.

    Args:
        play: plays one job.
        connect: returns a new line, which is closed at the end of the block; None for none.
    """
    if connect is None:
        yield play
        return
    with connect() as line:
        yield replace(cast("EpisodeRunner", play), hosts=line)


def _work(connection: Connection, watchdog: Watchdog, play: PlayJob, limit_threads: bool) -> None:
    """Play jobs from the connection until it is closed; runs in the worker process."""
    use_watchdog(watchdog)
    if limit_threads:
        # lavapipe reads this when it is loaded, which is later.
        os.environ.setdefault("LP_NUM_THREADS", "1")
    serve(connection, functools.partial(_play, play))


def _play(play: PlayJob, job: Job) -> Record | RoboIRGError:
    """Return the record of a job, or the error that would end every other job too.

    What is printed meanwhile goes into the episode's log, if `play` has a folder.
    """
    log: contextlib.AbstractContextManager[None] = contextlib.nullcontext()
    if isinstance(play, EpisodeRunner):
        log = logged_output(log_path(play.folder, job.slug))
    try:
        with watched("environment"), log:
            return play(job)
    except RoboIRGError as error:
        # The error is sent to the supervisor. Classes that end the run can be pickled and are kept;
        # any other becomes the base class.
        kind = type(error) if isinstance(error, EndOfRunError) else RoboIRGError
        return kind(str(error))
