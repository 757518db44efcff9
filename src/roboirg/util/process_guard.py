"""A guard between an interpreter and the process that started it; ends what that leaves behind."""

from __future__ import annotations

import contextlib
import ctypes
import importlib
import os
import resource
import signal
import socket
import sys
import time
from pathlib import Path

from roboirg.util.freed_memory import keep_freed_memory

_TERM_S = 0.5
"""How long what an interpreter has started may take to exit before it is killed."""
_PR_SET_PDEATHSIG, _PR_SET_CHILD_SUBREAPER = 1, 36


def run_main() -> None:
    """Run ``main(line)`` of a module in a child of this process, which guards it.

    The command line holds the descriptor of a socket, the parent's process id and the module.
    """
    number, parent, module = sys.argv[1:]
    sys.argv[1:] = []
    begin(int(parent))
    _guard(int(number))
    importlib.import_module(module).main(socket.socket(fileno=int(number)))


def begin(parent: int) -> None:
    """Put this process under the supervision of its parent, and prepare it for its work."""
    # Ctrl-C is for the parent, which decides what to do.
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    signal.pthread_sigmask(signal.SIG_UNBLOCK, {signal.SIGINT})
    signal.signal(signal.SIGTERM, signal.SIG_DFL)
    os.setsid()  # what it starts can be ended with it, and cannot reach the user's terminal
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
        number: descriptor of the socket, which is the child's alone.
    """
    waited = {signal.SIGCHLD, signal.SIGTERM}
    signal.pthread_sigmask(signal.SIG_BLOCK, waited)
    _prctl(_PR_SET_PDEATHSIG, signal.SIGTERM)
    _prctl(_PR_SET_CHILD_SUBREAPER, 1)  # what loses its parent gets this one
    guard, child = os.getpid(), os.fork()
    if child == 0:
        signal.pthread_sigmask(signal.SIG_UNBLOCK, waited)
        begin(guard)
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
    """Take leave of dead children; return how one of them ended, None if it has not.

    Raises:
        ChildProcessError: there is no child any more, dead or alive.
    """
    while True:
        pid, status = os.waitpid(-1, os.WNOHANG)
        if pid == child:
            return os.waitstatus_to_exitcode(status)
        if pid == 0:
            return None


def _end_descendants(child: int) -> None:
    """End all that a dead child has started, until nothing is left."""
    # First SIGTERM: Python's resource trackers are among them, and have to clean up.
    number, pause_s, until = signal.SIGTERM, 0.01, time.monotonic() + _TERM_S
    with contextlib.suppress(OSError):
        os.killpg(child, number)
    # What loses its parent becomes a child of this process: without children nothing is left.
    with contextlib.suppress(ChildProcessError):
        while True:
            for pid in descendants(os.getpid()):
                with contextlib.suppress(OSError):
                    os.kill(pid, number)
            time.sleep(pause_s)
            _reap(child)
            if time.monotonic() > until:
                number, pause_s = signal.SIGKILL, 0.001


def descendants(pid: int) -> list[int]:
    """Return the processes that a process has started, and theirs, the oldest generation first.

    The kernel lists the children of each, so nothing is read that a process could have written, and
    it is fast enough for a chain of processes, each of which starts the next one and exits.
    """
    found = [pid]
    for process in found:
        with contextlib.suppress(OSError):  # it has ended meanwhile
            for thread in Path(f"/proc/{process}/task").iterdir():
                found += map(int, (thread / "children").read_bytes().split())
    return found[1:]
