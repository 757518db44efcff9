"""Child processes: started with a channel, watched, ended; nothing of them outlives the parent.

The kernel kills a child when the thread that started it ends, so start it in a thread that lasts.
"""

from __future__ import annotations

import contextlib
import multiprocessing
import os
import resource
import signal
import threading
from collections.abc import Callable, Iterator
from multiprocessing import resource_tracker
from multiprocessing.connection import Connection
from multiprocessing.process import BaseProcess
from typing import Any, NamedTuple, Self, cast

from roboirg.core.errors import RoboIRGError
from roboirg.util.process_guard import begin

GRACE_S = 30.0
"""How long a child may take to exit once its channel is closed: seconds on a busy machine."""
_MANY_FILES = 65_536
_SAFE_PATH = "PYTHONSAFEPATH"
"""Variable that keeps the working directory, where a policy may lie, from the import path."""
_starting = threading.Lock()


class ChildExit(NamedTuple):
    """How a child ended.

    Attributes:
        code: its exit code, negative for a signal; None if it closed its channel and then had to
            be killed.
    """

    code: int | None

    @property
    def was_killed(self) -> bool:
        """Whether SIGKILL ended it: not its own doing, but a user's or the kernel's."""
        return self.code == -signal.SIGKILL

    def __str__(self) -> str:
        """Return how it ended in words: ``"the process ended with exit code 1"``."""
        if self.code is None:
            return "the process closed its connection"
        if self.code < 0:
            return f"the process died of signal {-self.code} ({signal.strsignal(-self.code)})"
        return f"the process ended with exit code {self.code}"


class ChildProcess:
    """A child process and our end of its channel; made by `spawn`.

    Attributes:
        connection: readable when the child has sent something, or is dead.
    """

    def __init__(self, process: BaseProcess, connection: Connection) -> None:
        self._process = process
        self.connection = connection

    @classmethod
    def spawn(cls, work: Callable[..., None], *args: Any) -> Self:  # noqa: ANN401
        """Start ``work(connection, *args)`` in a new interpreter; all of it must be picklable.

        Args:
            work: runs in the child.
            *args: its arguments.

        Raises:
            RoboIRGError: there is no room for another process or its files.
        """
        _allow_many_files()
        # Spawned, not forked: a forked Vulkan driver or thread pool is undefined behavior.
        context = multiprocessing.get_context("spawn")
        try:
            ours, theirs = context.Pipe()
            process = context.Process(
                target=_begin_work, args=(os.getpid(), work, theirs, args), daemon=False
            )
            with _safe_path():
                resource_tracker.ensure_running()  # which would unblock what is blocked below
                with without_interrupts():
                    process.start()
        except OSError as error:
            raise RoboIRGError(
                f"A process cannot be started: {error.strerror}; use fewer workers, or allow more "
                "open files and processes (ulimit -n, ulimit -u)."
            ) from error
        # Only the child may keep this end open: then its death reads as end of file.
        theirs.close()
        return cls(process, ours)

    @property
    def pid(self) -> int:
        """Its process id."""
        return cast("int", self._process.pid)  # it has been started

    @property
    def exit(self) -> ChildExit | None:
        """How it ended; None while it is alive."""
        code = self._process.exitcode
        return None if code is None else ChildExit(code)

    def send(self, message: Any) -> None:  # noqa: ANN401
        """Send a message; if the child is dead, the next `receive` raises."""
        with contextlib.suppress(OSError):
            self.connection.send(message)

    def receive(self) -> Any:  # noqa: ANN401
        """Return the child's next message, or its `ChildExit` if there is none any more."""
        try:
            return self.connection.recv()
        except (EOFError, OSError):
            return self.close()

    def kill(self) -> None:
        """Kill the child, and end what it has started."""
        self._process.kill()
        self._end_group()

    def close(self) -> ChildExit:
        """Let the child exit by closing its channel; kill it after `GRACE_S`; return how it ended.

        One that not even that ends, as a call of a driver may hang in the kernel, is left behind.
        """
        self.connection.close()
        self._process.join(GRACE_S)
        code = self._process.exitcode
        if code is None:
            self._process.kill()
            self._process.join(GRACE_S)
        self._end_group()
        return ChildExit(code)

    def end(self) -> None:
        """Kill the child at once."""
        self.kill()
        self.close()

    def _end_group(self) -> None:
        """End what the child has started."""
        # Not SIGKILL: Python's resource trackers are among them, and have to clean up.
        with contextlib.suppress(OSError):
            os.killpg(self.pid, signal.SIGTERM)


def _allow_many_files() -> None:
    """Let this process open more files than the usual 1,024, few for workers with policies."""
    limit, most = resource.getrlimit(resource.RLIMIT_NOFILE)
    wanted = max(limit, min(most, _MANY_FILES))
    resource.setrlimit(resource.RLIMIT_NOFILE, (wanted, most))


def serve(connection: Connection, answer: Callable[[Any], Any]) -> None:
    """Answer every message until the channel closes; runs in a child.

    The channel closes when the parent hangs up or dies, before a message or before the reply.
    """
    while True:
        try:
            message = connection.recv()
        except (EOFError, OSError):
            return
        reply = answer(message)
        try:
            connection.send(reply)
        except BrokenPipeError:
            return


@contextlib.contextmanager
def without_interrupts() -> Iterator[None]:
    """Block Ctrl-C here, and in a process that is started, which ignores it as soon as it can."""
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)


@contextlib.contextmanager
def _safe_path() -> Iterator[None]:
    """Let a process start without the working directory on its path.

    A file there, such as ``random.py``, would be imported in place of the library's. The variable
    is one of the whole process, so one process is started at a time.
    """
    with _starting:
        before = os.environ.get(_SAFE_PATH)
        os.environ[_SAFE_PATH] = "1"
        try:
            yield
        finally:
            if before is None:
                del os.environ[_SAFE_PATH]


def _begin_work(
    parent: int, work: Callable[..., None], connection: Connection, args: tuple[Any, ...]
) -> None:
    """Do the work of a child, under the supervision of its parent; runs in the child."""
    os.environ.pop(_SAFE_PATH, None)
    begin(parent)
    work(connection, *args)
