"""Child processes: started with a channel, watched, ended; nothing of them outlives the parent.

The kernel kills a child when the thread that started it ends, so start it in a thread that lasts.
"""

from __future__ import annotations

import contextlib
import json
import multiprocessing
import os
import signal
import socket
import subprocess
import sys
import threading
from collections.abc import Callable, Iterator, Mapping
from multiprocessing import resource_tracker
from multiprocessing.connection import Connection
from multiprocessing.process import BaseProcess
from typing import IO, Any, NamedTuple, Self, cast

from roboirg.util.process_guard import begin, descendants

GRACE_S = 2.0
"""How long a child may take to exit once its channel is closed."""
GUARD_S = 5.0
"""How long a guard may take to end all that an interpreter has started."""
_SAFE_PATH = "PYTHONSAFEPATH"
"""Variable that keeps the working directory, where a policy may lie, from the import path."""
_starting = threading.Lock()

# The first thing the interpreter gets is the import path.
_BOOT = (
    "import json, sys; sys.path[:] = json.loads(sys.argv.pop()); "
    "from roboirg.util.process_guard import run_main; run_main()"
)


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
        if self.code is None:
            return "the process closed its connection"
        if self.code < 0:
            return f"the process died of signal {-self.code}"
        return f"the process ended with exit code {self.code}"


class _Interpreter(subprocess.Popen[bytes]):
    """The guard of an interpreter; ends as that has ended, once nothing of it is left."""

    @property
    def exitcode(self) -> int | None:
        return self.poll()

    def kill(self) -> None:
        """Let the guard kill all; if something has stopped it, kill it and them."""
        self.terminate()
        self.join(GUARD_S)
        if self.poll() is None:
            for pid in descendants(self.pid):
                with contextlib.suppress(OSError):
                    os.kill(pid, signal.SIGKILL)
        super().kill()

    def join(self, timeout: float | None = None) -> None:
        with contextlib.suppress(subprocess.TimeoutExpired):
            self.wait(timeout)


class ChildProcess:
    """A child process and our end of its channel; made by `spawn` or `run_module`.

    Attributes:
        connection: readable when the child has sent something, or is dead.
        output: what the child prints, if that does not go where this process prints.
    """

    def __init__(
        self,
        process: BaseProcess | _Interpreter,
        connection: Connection,
        output: IO[bytes] | None = None,
    ) -> None:
        self._process, self.connection, self.output = process, connection, output

    @classmethod
    def spawn(cls, work: Callable[..., None], *args: Any, daemon: bool = False) -> Self:  # noqa: ANN401
        """Start ``work(connection, *args)`` in a new interpreter; all of it must be picklable.

        Args:
            work: runs in the child.
            *args: its arguments.
            daemon: whether a parent that exits without closing it ends it, instead of waiting for
                it; it may then have no processes of its own by `multiprocessing`.
        """
        # Spawned, not forked: a forked Vulkan driver or thread pool is undefined behavior.
        context = multiprocessing.get_context("spawn")
        ours, theirs = context.Pipe()
        process = context.Process(
            target=_begin_work, args=(os.getpid(), work, theirs, args), daemon=daemon
        )
        with _safe_path():
            resource_tracker.ensure_running()  # which would unblock what is blocked below
            with _without_interrupts():
                process.start()
        # Only the child may keep this end open: then its death reads as end of file.
        theirs.close()
        return cls(process, ours)

    @classmethod
    def run_module(cls, module: str, variables: Mapping[str, str | None]) -> Self:
        """Start ``main(connection)`` of a module in an interpreter that knows nothing of this one.

        The script and command line of this process are kept from it. It has the environment of this
        process and `variables`; those that are None it has not. When it ends, a guard between the
        two ends all that it has started, and our end of the channel reads as end of file.
        """
        ours, theirs = socket.socketpair()
        wanted = {**os.environ, **variables}
        with theirs, _without_interrupts():
            number = theirs.fileno()
            arguments = (str(number), str(os.getpid()), module, json.dumps(sys.path))
            process = _Interpreter(
                [sys.executable, "-P", "-c", _BOOT, *arguments],
                pass_fds=[number],
                stdin=subprocess.DEVNULL,
                stdout=subprocess.PIPE,
                stderr=subprocess.STDOUT,
                env={name: value for name, value in wanted.items() if value is not None},
            )
        child = cls(process, Connection(os.dup(ours.fileno())), process.stdout)
        threading.Thread(target=_hang_up, args=(process, ours), daemon=True).start()
        return child

    @property
    def pid(self) -> int:
        """Its process id."""
        if isinstance(self._process, _Interpreter):
            return next(iter(descendants(self._process.pid)), self._process.pid)
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
        """Let the child exit by closing its channel; kill it after `GRACE_S`."""
        self.connection.close()
        self._process.join(GRACE_S)
        code = self._process.exitcode
        if code is None:
            self._process.kill()
            self._process.join()
        self._end_group()
        return ChildExit(code)

    def end(self) -> None:
        """Kill the child at once."""
        self.kill()
        self.close()

    def _end_group(self) -> None:
        # Not SIGKILL: Python's resource trackers are among them, and have to clean up.
        # An interpreter's guard has seen to it.
        if not isinstance(self._process, _Interpreter):
            with contextlib.suppress(OSError):
                os.killpg(self.pid, signal.SIGTERM)


def serve(connection: Connection, answer: Callable[[Any], Any]) -> None:
    """Answer every message until the channel closes; runs in a child."""
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
def _without_interrupts() -> Iterator[None]:
    """Block Ctrl-C here, and in a process that is started, which ignores it as soon as it can."""
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)


@contextlib.contextmanager
def _safe_path() -> Iterator[None]:
    """Let a process start without the working directory on its path, until it gets ours."""
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
    os.environ.pop(_SAFE_PATH, None)
    begin(parent)
    work(connection, *args)


def _hang_up(process: _Interpreter, line: socket.socket) -> None:
    """Close a channel when its process has ended, even if others have its other end, too."""
    process.wait()
    with line, contextlib.suppress(OSError):
        line.shutdown(socket.SHUT_RDWR)
