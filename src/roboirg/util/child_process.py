"""Child processes: started with a channel, watched, ended; nothing of them outlives the parent.

The kernel kills a child when the thread that started it ends, so start it in a thread that lasts.
"""

from __future__ import annotations

import contextlib
import ctypes
import importlib
import json
import multiprocessing
import os
import resource
import signal
import socket
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Iterator, Mapping
from multiprocessing import resource_tracker
from multiprocessing.connection import Connection
from multiprocessing.process import BaseProcess
from pathlib import Path
from typing import IO, Any, NamedTuple, Self, cast

from roboirg.util.freed_memory import keep_freed_memory

GRACE_S = 2.0
"""How long a child may take to exit once its channel is closed."""
GUARD_S = 5.0
"""How long a guard may take to end all that an interpreter has started."""
_TERM_S = 0.5
"""How long what an interpreter has started may take to exit before it is killed."""

_PR_SET_PDEATHSIG, _PR_SET_CHILD_SUBREAPER = 1, 36
# The first thing the interpreter gets is the import path.
_BOOT = (
    "import json, sys; sys.path[:] = json.loads(sys.argv.pop()); "
    "from roboirg.util.child_process import _run_main; _run_main()"
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
            for pid in _descendants(self.pid):
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
                [sys.executable, "-c", _BOOT, *arguments],
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
            return next(iter(_descendants(self._process.pid)), self._process.pid)
        return cast("int", self._process.pid)  # it has been started

    @property
    def exit(self) -> ChildExit | None:
        """How it ended; None while it is alive."""
        code = self._process.exitcode
        return None if code is None else ChildExit(code)

    def send(self, message: Any) -> None:  # noqa: ANN401
        """Send a message; if the child is dead, the next `receive` tells."""
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


def _begin_work(
    parent: int, work: Callable[..., None], connection: Connection, args: tuple[Any, ...]
) -> None:
    _begin(parent)
    work(connection, *args)


def _hang_up(process: _Interpreter, line: socket.socket) -> None:
    """Close a channel when its process has ended, even if others have its other end, too."""
    process.wait()
    with line, contextlib.suppress(OSError):
        line.shutdown(socket.SHUT_RDWR)


def _run_main() -> None:
    number, parent, module = sys.argv[1:]
    sys.argv[1:] = []
    _begin(int(parent))
    _guard(int(number))
    importlib.import_module(module).main(Connection(int(number)))


def _begin(parent: int) -> None:
    """Put this process under the supervision of its parent, and prepare it for its work."""
    # Ctrl-C is for the parent, which decides what to do.
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    signal.pthread_sigmask(signal.SIG_UNBLOCK, {signal.SIGINT})
    signal.signal(signal.SIGTERM, signal.SIG_DFL)
    os.setpgid(0, 0)  # what it starts can be ended with it
    _prctl(_PR_SET_PDEATHSIG, signal.SIGKILL)  # even if it hangs in native code
    if os.getppid() != parent:
        os._exit(1)  # the parent died before the line above
    keep_freed_memory()


def _prctl(option: int, value: int) -> None:
    if sys.platform == "linux":
        ctypes.CDLL(None).prctl(option, value)


def _guard(number: int) -> None:
    """Fork: the child returns; this process ends all that comes of it, and then ends as it has.

    Where there are no subreapers and no ``/proc``, as on macOS, that is the child's process group.

    Args:
        number: descriptor of the channel, which is the child's alone.
    """
    waited = {signal.SIGCHLD, signal.SIGTERM}
    signal.pthread_sigmask(signal.SIG_BLOCK, waited)
    _prctl(_PR_SET_PDEATHSIG, signal.SIGTERM)
    _prctl(_PR_SET_CHILD_SUBREAPER, 1)  # what loses its parent gets this one
    guard, child = os.getpid(), os.fork()
    if child == 0:
        signal.pthread_sigmask(signal.SIG_UNBLOCK, waited)
        _begin(guard)
        return
    nothing = os.open(os.devnull, os.O_RDWR)
    for descriptor in (0, 1, 2, number):
        os.dup2(nothing, descriptor)
    code = None
    while code is None:
        if signal.sigwait(waited) == signal.SIGTERM:
            os.kill(child, signal.SIGKILL)
        code = _reap(child)
    _end_descendants(child)
    if code < 0:
        resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
        with contextlib.suppress(OSError):  # SIGKILL has no handler
            signal.signal(-code, signal.SIG_DFL)
        signal.pthread_sigmask(signal.SIG_UNBLOCK, {-code})
        os.kill(guard, -code)
    os._exit(code)


def _reap(child: int) -> int | None:
    """Take leave of all dead children; return how one of them ended, None if it has not."""
    code = None
    with contextlib.suppress(ChildProcessError):
        while (found := os.waitpid(-1, os.WNOHANG))[0]:
            if found[0] == child:
                code = os.waitstatus_to_exitcode(found[1])
    return code


def _end_descendants(child: int) -> None:
    """End all that a dead child has started, until nothing is left."""
    # First SIGTERM: Python's resource trackers are among them, and have to clean up.
    number, until = signal.SIGTERM, time.monotonic() + _TERM_S
    with contextlib.suppress(OSError):
        os.killpg(child, number)
    while found := _descendants(os.getpid()):
        for pid in found:
            with contextlib.suppress(OSError):
                os.kill(pid, number)
        time.sleep(0.01)
        _reap(child)
        if time.monotonic() > until:
            number = signal.SIGKILL


def _descendants(pid: int) -> list[int]:
    """Return the processes that a process has started, and theirs, the oldest generation first."""
    children: dict[int, list[int]] = {}
    for path in Path("/proc").glob("[0-9]*/stat"):
        with contextlib.suppress(OSError):  # it has ended meanwhile
            parent = int(path.read_text().rpartition(")")[2].split()[1])
            children.setdefault(parent, []).append(int(path.parent.name))
    found = [pid]
    for one in found:
        found += children.get(one, [])
    return found[1:]
