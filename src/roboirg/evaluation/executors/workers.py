"""Supervised worker process that plays one job after the other.

The supervisor gets exactly one record for each job within bounded time: the worker's own; an error
that names the phase in which the worker died; or, if a policy call or the whole episode exceeds its
limit, a timeout error after the worker has been killed.
"""

from __future__ import annotations

import contextlib
import multiprocessing
import os
import signal
import threading
import time
from dataclasses import dataclass
from multiprocessing.connection import Connection, wait
from multiprocessing.process import BaseProcess
from typing import NamedTuple

from roboirg.core.errors import MissingDependencyError, RenderDeviceError, RoboIRGError
from roboirg.evaluation.episode_errors import format_cause
from roboirg.evaluation.executors.watchdog import Phase, Watchdog, use_watchdog, watched
from roboirg.evaluation.rollout import EpisodeRunner, PlayJob
from roboirg.evaluation.rollout_result import RolloutResult, make_record, utc_now
from roboirg.records.episode_log import log_path, logged_output
from roboirg.records.record import ErrorKind, Job, Record
from roboirg.util.child_process import describe_exit, exit_with_parent, was_killed

GRACE_S = 2.0
"""How long a worker may take to exit when it is asked to."""

MAX_FAILED_STARTS = 3
"""Consecutive failed starts, for each worker, after which the run stops."""

POLL_S = 0.25
"""How often a supervisor checks deadlines."""

_FATAL_ERRORS = {error.__name__: error for error in (RenderDeviceError, MissingDependencyError)}


class _FatalError(NamedTuple):
    """An error that ends the run, as a worker sends it."""

    kind: str
    message: str


@dataclass
class Worker:
    """A worker process, the supervisor's end of its pipe, and its current job.

    Attributes:
        process: plays the jobs.
        connection: readable when there is a record or the process has died.
        watchdog: current phase of the process.
        job: the current job.
        started: when the job was assigned, seconds of the monotonic clock.
        started_at: the same for records.
    """

    process: BaseProcess
    connection: Connection
    watchdog: Watchdog
    job: Job
    started: float = 0.0
    started_at: str = ""

    @classmethod
    def start(cls, play: PlayJob, job: Job, *, limit_threads: bool = False) -> Worker:
        """Start a process and assign its first job.

        Args:
            play: plays one job.
            job: the first job.
            limit_threads: render with one thread, because every core has its own process.
        """
        # Spawned, not forked: a forked Vulkan driver or thread pool is undefined behavior.
        context = multiprocessing.get_context("spawn")
        ours, theirs = context.Pipe()
        watchdog = Watchdog(context)
        # Not a daemon in multiprocessing's sense: policies may have processes of their own.
        process = context.Process(
            target=_worker_main, args=(theirs, watchdog, play, limit_threads, os.getpid())
        )
        process.start()
        # Only the worker may keep this end open: then its death reads as end of file.
        theirs.close()
        worker = cls(process, ours, watchdog, job)
        worker.assign(job)
        return worker

    def assign(self, job: Job) -> None:
        """Send the next job to an idle worker."""
        self.job, self.started, self.started_at = job, time.monotonic(), utc_now()
        self.watchdog.begin_job()
        # If the process has already died, the next receive notices it.
        with contextlib.suppress(BrokenPipeError):
            self.connection.send(job)

    def receive(self) -> Record:
        """Return the record of the job once the connection is readable.

        The worker may be dead afterwards.

        Raises:
            RoboIRGError: an error that would end every other job too (no Vulkan device, …).
        """
        try:
            reply = self.connection.recv()
        except (EOFError, ConnectionResetError):
            self.process.join()
            self.connection.close()
            kind, message = _explain_exit(self.watchdog.phase, self.process.exitcode)
            return self._error_record(kind, message)
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
        self.process.kill()
        self.process.join()
        self.connection.close()
        return self._error_record("timeout", message)

    @property
    def is_dead(self) -> bool:
        """Whether the process has died or been killed."""
        return self.connection.closed

    @property
    def failed_to_start(self) -> bool:
        """Whether the process died before it played anything."""
        return self.is_dead and self.watchdog.phase == "worker startup"

    def release(self) -> None:
        """Let an idle process exit by closing the pipe."""
        self.connection.close()

    def stop(self) -> None:
        """Terminate the process, whatever it is doing."""
        self.process.terminate()
        self.connection.close()

    def join(self) -> None:
        """Wait until the process has exited; kill it after `GRACE_S`."""
        self.process.join(GRACE_S)
        if self.process.exitcode is None:
            self.process.kill()
            self.process.join()

    def _error_record(self, kind: ErrorKind, message: str) -> Record:
        result = RolloutResult()
        result.record_error(kind, format_cause(kind, message))
        spent = round(time.monotonic() - self.started, 3)
        return make_record(self.job, result, started_at=self.started_at, duration_s=spent)


class WorkerSlot:
    """Plays one job after the other in a supervised process, replaced when it dies.

    Args:
        play: plays one job.
        episode_timeout_s: how long an episode may take.
    """

    def __init__(self, play: PlayJob, episode_timeout_s: float) -> None:
        self._play, self._episode_timeout_s = play, episode_timeout_s
        self._worker: Worker | None = None

    def play(self, job: Job) -> Record:
        """Play a job; the process is kept for the next one.

        Raises:
            RoboIRGError: an error that would end every other job too (no Vulkan device, …).
        """
        if self._worker is None:
            self._worker = Worker.start(self._play, job, limit_threads=True)
        else:
            self._worker.assign(job)
        record = _wait_for_record(self._worker, self._episode_timeout_s)
        if self._worker.is_dead:
            self._worker = None
        return record

    def close(self) -> None:
        """Terminate the process."""
        if self._worker is not None:
            self._worker.stop()
            self._worker.join()
            self._worker = None


def _wait_for_record(worker: Worker, episode_timeout_s: float) -> Record:
    while True:
        if wait([worker.connection], POLL_S):
            return worker.receive()
        record = worker.kill_if_overdue(episode_timeout_s)
        if record is not None:
            return record


def _explain_exit(phase: Phase, exit_code: int | None) -> tuple[ErrorKind, str]:
    """Return the kind of error and the message for a process that died."""
    how = describe_exit(exit_code)
    if was_killed(exit_code):
        return "infrastructure", f"{how} in the {phase}"
    if phase.startswith("policy"):
        return "policy", f"{how} in the {phase}"
    return "environment", f"{how} in the {phase}"


def _worker_main(
    connection: Connection, watchdog: Watchdog, play: PlayJob, limit_threads: bool, parent: int
) -> None:
    """Play jobs from the connection until it is closed; runs in the worker process."""
    # Ctrl-C reaches the whole process group; the parent decides what to do.
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    signal.signal(signal.SIGTERM, signal.SIG_DFL)
    _exit_with_parent(parent)
    use_watchdog(watchdog)
    if limit_threads:
        # lavapipe reads this when it is loaded, which is later.
        os.environ.setdefault("LP_NUM_THREADS", "1")
    while True:
        try:
            job = connection.recv()
        except EOFError:
            return
        try:
            with watched("environment"), _logged(play, job):
                reply: Record | _FatalError = play(job)
        except RoboIRGError as error:
            reply = _FatalError(type(error).__name__, str(error))
        try:
            connection.send(reply)
        except BrokenPipeError:
            return


def _logged(play: PlayJob, job: Job) -> contextlib.AbstractContextManager[None]:
    """Send what is printed during a job to its log, if the run has a folder."""
    if isinstance(play, EpisodeRunner):
        return logged_output(log_path(play.folder, job.slug))
    return contextlib.nullcontext()


def _exit_with_parent(parent: int) -> None:
    """Make sure that this process does not outlive its parent."""
    exit_with_parent(parent)
    parent_process = multiprocessing.parent_process()
    if parent_process is not None:
        sentinel = parent_process.sentinel
        threading.Thread(target=_exit_when_ready, args=(sentinel,), daemon=True).start()


def _exit_when_ready(sentinel: int) -> None:
    wait([sentinel])
    os._exit(1)
