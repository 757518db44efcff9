"""A supervised process that plays jobs one after the other.

Whatever happens in it, its supervisor gets one record for each job within bounded time: the
process's own; an error that says what it was doing when it died; or, when a call of the policy or
the whole episode takes longer than it may, an error after the process has been killed.
"""

from __future__ import annotations

import contextlib
import ctypes
import multiprocessing
import os
import signal
import sys
import threading
import time
from dataclasses import dataclass
from multiprocessing.connection import Connection, wait
from multiprocessing.process import BaseProcess
from typing import NamedTuple

from roboirg.core.errors import MissingDependencyError, RenderDeviceError, RoboIRGError
from roboirg.evaluation.episode_errors import format_cause
from roboirg.evaluation.executors.watchdog import Phase, Watchdog, use_watchdog, watched
from roboirg.evaluation.rollout import PlayJob
from roboirg.evaluation.rollout_result import RolloutResult, make_record, utc_now
from roboirg.records.record import ErrorKind, Job, Record

GRACE_S = 2.0
"""How long a worker may take to go when it is told to."""

MAX_FAILED_STARTS = 3
"""So many processes for each that is wanted may fail to start, one after the other."""

POLL_S = 0.25
"""How often a supervisor looks whether somebody is overdue."""

_PR_SET_PDEATHSIG = 1
_FATAL_ERRORS = {error.__name__: error for error in (RenderDeviceError, MissingDependencyError)}


class _FatalError(NamedTuple):
    kind: str
    sentence: str


@dataclass
class Worker:
    """A process, our end of the pipe to it, and what it is playing.

    Attributes:
        process: plays.
        connection: readable when there is a record, or when the process is gone.
        board: what it is at.
        job: what it is playing.
        started: when it began with that, seconds of the monotonic clock.
        started_at: the same for records.
    """

    process: BaseProcess
    connection: Connection
    board: Watchdog
    job: Job
    started: float = 0.0
    started_at: str = ""

    @classmethod
    def hire(cls, play: PlayJob, job: Job, *, crowded: bool = False) -> Worker:
        """Start a process and give it its first job.

        Args:
            play: plays one job.
            job: the first.
            crowded: whether there is a process on every core.
        """
        # Spawned, not forked: a forked Vulkan driver or thread pool is undefined behavior.
        context = multiprocessing.get_context("spawn")
        ours, theirs = context.Pipe()
        board = Watchdog(context)
        # Not a daemon in multiprocessing's sense: policies may have processes of their own.
        process = context.Process(
            target=_worker_main, args=(theirs, board, play, crowded, os.getpid())
        )
        process.start()
        # Ours must be the only other end, so that its death reads as the end of the file.
        theirs.close()
        worker = cls(process, ours, board, job)
        worker.assign(job)
        return worker

    def assign(self, job: Job) -> None:
        """Give it the next job; it has none at the moment."""
        self.job, self.started, self.started_at = job, time.monotonic(), utc_now()
        # A process that is already dead is noticed at the next receive.
        with contextlib.suppress(BrokenPipeError):
            self.connection.send(job)

    def receive(self) -> Record:
        """The record of its job, once the connection is readable; it may be dead afterwards.

        Raises:
            RoboIRGError: what would end every other job too (no Vulkan device, …).
        """
        try:
            reply = self.connection.recv()
        except (EOFError, ConnectionResetError):
            self.process.join()
            self.connection.close()
            kind, what = _explain_exit(self.board.phase, self.process.exitcode)
            return self._error(kind, what)
        if isinstance(reply, _FatalError):
            raise _FATAL_ERRORS.get(reply.kind, RoboIRGError)(reply.sentence)
        if not isinstance(reply, Record):
            raise TypeError(f"a worker sent {type(reply).__name__}, not a Record")
        return reply

    def overdue(self, episode_timeout_s: float) -> Record | None:
        """The record of its job if that has taken too long; then the process has been killed."""
        if self.board.is_overdue:
            what = f"the {self.board.phase} did not come back in time"
        elif time.monotonic() - self.started > episode_timeout_s:
            what = (
                f"the episode took longer than {episode_timeout_s:g} s "
                f"(now in the {self.board.phase})"
            )
        else:
            return None
        self.process.kill()
        self.process.join()
        self.connection.close()
        return self._error("timeout", what)

    @property
    def is_gone(self) -> bool:
        """Whether it has died or been killed."""
        return self.connection.closed

    @property
    def is_stillborn(self) -> bool:
        """Whether it is gone without ever having begun to play."""
        return self.is_gone and self.board.phase == "start"

    def dismiss(self) -> None:
        """Let it go: it has nothing to do, so closing the pipe ends it."""
        self.connection.close()

    def stop(self) -> None:
        """End it in the middle of what it does."""
        self.process.terminate()
        self.connection.close()

    def bury(self) -> None:
        """See it gone."""
        self.process.join(GRACE_S)
        if self.process.exitcode is None:
            self.process.kill()
            self.process.join()

    def _error(self, kind: ErrorKind, what: str) -> Record:
        course = RolloutResult()
        course.fail(kind, format_cause(kind, what))
        spent = round(time.monotonic() - self.started, 3)
        return make_record(self.job, course, started_at=self.started_at, duration_s=spent)


class WorkerSlot:
    """A place where one job after the other is played by a supervised process.

    Args:
        play: plays one job.
        episode_timeout_s: how long an episode may take.
    """

    def __init__(self, play: PlayJob, episode_timeout_s: float) -> None:
        self._play, self._episode_timeout_s = play, episode_timeout_s
        self._worker: Worker | None = None

    def play(self, job: Job) -> Record:
        """Play a job; the process that does it lives on for the next one.

        Raises:
            RoboIRGError: what would end every other job too (no Vulkan device, …).
        """
        if self._worker is None:
            self._worker = Worker.hire(self._play, job, crowded=True)
        else:
            self._worker.assign(job)
        record = _wait_for_record(self._worker, self._episode_timeout_s)
        if self._worker.is_gone:
            self._worker = None
        return record

    def close(self) -> None:
        """End the process."""
        if self._worker is not None:
            self._worker.stop()
            self._worker.bury()
            self._worker = None


def _wait_for_record(worker: Worker, episode_timeout_s: float) -> Record:
    while True:
        if wait([worker.connection], POLL_S):
            return worker.receive()
        record = worker.overdue(episode_timeout_s)
        if record is not None:
            return record


def _explain_exit(phase: Phase, exit_code: int | None) -> tuple[ErrorKind, str]:
    """Whose fault it is that a process died, and how it did."""
    if exit_code is not None and exit_code < 0:
        how = f"the process died of signal {-exit_code}"
    else:
        how = f"the process ended with exit code {exit_code}"
    if exit_code == -signal.SIGKILL:
        # Nothing does that to itself: the machine ran out of memory, or somebody killed it.
        return "infrastructure", f"{how} in the {phase}"
    if phase.startswith("policy"):
        return "policy", f"{how} in the {phase}"
    return "environment", f"{how} in the {phase}"


def _worker_main(
    connection: Connection, board: Watchdog, play: PlayJob, crowded: bool, parent: int
) -> None:
    """The life of a worker process."""
    # Ctrl-C reaches the whole process group; the parent decides what it means.
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    signal.signal(signal.SIGTERM, signal.SIG_DFL)
    _exit_with_parent(parent)
    use_watchdog(board)
    if crowded:
        # Read by lavapipe when it is loaded, which is later than this.
        os.environ.setdefault("LP_NUM_THREADS", "1")
    while True:
        try:
            job = connection.recv()
        except EOFError:
            return
        try:
            with watched("world"):
                reply: Record | _FatalError = play(job)
        except RoboIRGError as error:
            reply = _FatalError(type(error).__name__, str(error))
        try:
            connection.send(reply)
        except BrokenPipeError:
            return


def _exit_with_parent(parent: int) -> None:
    """See to it that this process does not outlive the one that made it."""
    if sys.platform == "linux":
        # Even when this process hangs in native code. Tied to the thread that made it, which
        # waits for as long as there are workers.
        ctypes.CDLL(None).prctl(_PR_SET_PDEATHSIG, signal.SIGKILL)
    if os.getppid() != parent:
        os._exit(1)  # it died before the line above
    maker = multiprocessing.parent_process()
    if maker is not None:
        watch = threading.Thread(target=_exit_when_ready, args=(maker.sentinel,), daemon=True)
        watch.start()


def _exit_when_ready(sentinel: int) -> None:
    wait([sentinel])
    os._exit(1)
