"""Where jobs are played: in this process, or in processes beside it.

An executor gets jobs and a way to play them and yields one record for each, in the order in
which they end. It stores nothing: the caller does, the moment a record arrives. Whoever writes
another (Ray, a cluster) implements `Executor` and nothing else.
"""

from __future__ import annotations

import contextlib
import ctypes
import multiprocessing
import os
import signal
import sys
import threading
from collections import deque
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from multiprocessing.connection import Connection, wait
from multiprocessing.process import BaseProcess
from typing import NamedTuple, Protocol

from roboirg.errors import (
    InvalidValueError,
    MissingDependencyError,
    RenderDeviceError,
    RoboIRGError,
)
from roboirg.evaluation.record import Job, Record
from roboirg.evaluation.rollout import Course, Play, describe, utc_now

ATTEMPTS = 2
"""A job whose worker dies gets one more chance: the first death may have been the machine's."""

GRACE_S = 2.0
"""How long a worker may take to go when it is told to."""

_PR_SET_PDEATHSIG = 1
_FATAL = {error.__name__: error for error in (RenderDeviceError, MissingDependencyError)}


class Executor(Protocol):
    """Plays jobs somewhere."""

    def run(self, jobs: Sequence[Job], play: Play) -> Iterator[Record]:
        """Yield one record for each job, as they end; closing the iterator stops the rest.

        Raises:
            RoboIRGError: what would end every other job too (no Vulkan device, …).
        """


@dataclass(frozen=True, slots=True)
class InProcess:
    """Plays one job after the other right here: for debuggers. A crash takes all with it."""

    def run(self, jobs: Sequence[Job], play: Play) -> Iterator[Record]:
        """Yield one record for each job, in their order."""
        yield from map(play, jobs)


@dataclass(frozen=True, slots=True)
class LocalProcesses:
    """Plays jobs in processes of this machine that live as long as there is work.

    A process that dies (segmentation fault, out of memory) costs its job one attempt; after
    the second the job's record is an error and the others go on. The processes die with the
    one that made them, however it dies.

    Args:
        workers: how many at most, at least 1.

    Raises:
        InvalidValueError: fewer than one worker.
    """

    workers: int

    def __post_init__(self) -> None:
        if self.workers < 1:
            raise InvalidValueError(f"workers is {self.workers}; it must be at least 1.")

    def run(self, jobs: Sequence[Job], play: Play) -> Iterator[Record]:
        """Yield one record for each job, as they end."""
        waiting = deque(_Task(job) for job in jobs)
        # With a process on every core, Mesa's own threads would only take turns.
        crowded = self.workers >= core_count()
        crew: dict[Connection, _Worker] = {}
        retired: list[_Worker] = []
        try:
            while waiting or crew:
                while waiting and len(crew) < self.workers:
                    worker = _Worker.hire(play, crowded, waiting.popleft())
                    crew[worker.connection] = worker
                for connection in wait(list(crew)):
                    worker = crew[_as_connection(connection)]
                    reply = worker.receive()
                    if isinstance(reply, _Death):
                        del crew[worker.connection]
                        retry, record = _after_death(worker.task, reply)
                        waiting.extendleft(retry)
                    else:
                        record = reply
                        if waiting:
                            worker.assign(waiting.popleft())
                        else:
                            retired.append(crew.pop(worker.connection))
                            worker.dismiss()
                    if record is not None:
                        yield record
        finally:
            for worker in crew.values():
                worker.stop()
            for worker in (*crew.values(), *retired):
                worker.bury()


def choose_executor(workers: int | None) -> Executor:
    """The executor for a number of workers: None for one per core, 0 for this process.

    Raises:
        InvalidValueError: a negative number.
    """
    if workers == 0:
        return InProcess()
    return LocalProcesses(core_count() if workers is None else workers)


def core_count() -> int:
    """How many cores this process may use."""
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1


class _Task(NamedTuple):
    job: Job
    attempt: int = 1


class _Death(NamedTuple):
    reason: str


class _Fatal(NamedTuple):
    kind: str
    sentence: str


@dataclass
class _Worker:
    """A process, our end of the pipe to it, and what it is playing."""

    process: BaseProcess
    connection: Connection
    task: _Task

    @classmethod
    def hire(cls, play: Play, crowded: bool, task: _Task) -> _Worker:
        # Spawned, not forked: a forked Vulkan driver or thread pool is undefined behaviour.
        context = multiprocessing.get_context("spawn")
        ours, theirs = context.Pipe()
        # Not a daemon in multiprocessing's sense: policies may have processes of their own.
        process = context.Process(target=_work, args=(theirs, play, crowded, os.getpid()))
        process.start()
        # Ours must be the only other end, so that its death reads as the end of the file.
        theirs.close()
        worker = cls(process, ours, task)
        worker.assign(task)
        return worker

    def assign(self, task: _Task) -> None:
        self.task = task
        # A process that is already dead is noticed at the next receive.
        with contextlib.suppress(BrokenPipeError):
            self.connection.send(task.job)

    def receive(self) -> Record | _Death:
        try:
            reply = self.connection.recv()
        except (EOFError, ConnectionResetError):
            self.process.join()
            self.connection.close()
            return _Death(_reason(self.process.exitcode))
        if isinstance(reply, _Fatal):
            raise _FATAL.get(reply.kind, RoboIRGError)(reply.sentence)
        if not isinstance(reply, Record):
            raise TypeError(f"a worker sent {type(reply).__name__}, not a Record")
        return reply

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


def _after_death(task: _Task, death: _Death) -> tuple[list[_Task], Record | None]:
    if task.attempt < ATTEMPTS:
        return [_Task(task.job, task.attempt + 1)], None
    course = Course(cause=f"environment: worker died ({death.reason})")
    return [], describe(task.job, course, started_at=utc_now())


def _reason(exit_code: int | None) -> str:
    if exit_code is not None and exit_code < 0:
        return f"signal {-exit_code}"
    return f"exit code {exit_code}"


def _as_connection(ready: object) -> Connection:
    if not isinstance(ready, Connection):
        raise TypeError(f"{ready!r} is not one of our pipes")
    return ready


def _work(connection: Connection, play: Play, crowded: bool, parent: int) -> None:
    """The life of a worker process."""
    # Ctrl-C reaches the whole process group; the parent decides what it means.
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    signal.signal(signal.SIGTERM, signal.SIG_DFL)
    _die_with(parent)
    if crowded:
        # Read by lavapipe when it is loaded, which is later than this.
        os.environ.setdefault("LP_NUM_THREADS", "1")
    while True:
        try:
            job = connection.recv()
        except EOFError:
            return
        try:
            reply: Record | _Fatal = play(job)
        except RoboIRGError as error:
            reply = _Fatal(type(error).__name__, str(error))
        try:
            connection.send(reply)
        except BrokenPipeError:
            return


def _die_with(parent: int) -> None:
    """See to it that this process does not outlive the one that made it."""
    if sys.platform == "linux":
        # Even when this process hangs in native code. Tied to the thread that made it, which
        # waits in `LocalProcesses.run` for as long as there are workers.
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
