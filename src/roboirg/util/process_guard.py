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
_TERM_PAUSE_S = 0.01
_KILL_PAUSE_S = 0.001
"""How long to wait between two rounds of signals."""
_PR_SET_PDEATHSIG = 1
_PR_SET_CHILD_SUBREAPER = 36
"""Of Linux: the signal that a process gets when its parent dies; and that it becomes the parent of
what its descendants leave behind."""


def run_main() -> None:
    """Run ``main(line)`` of a module in a child of this process, which guards it.

    The command line holds the descriptor of a socket, the parent's process id and the module.
    """
    descriptor, parent, module = sys.argv[1:]
    sys.argv[1:] = []  # the module may read its own
    begin(int(parent))
    _guard(int(descriptor))
    line = socket.socket(fileno=int(descriptor))
    importlib.import_module(module).main(line)


def begin(parent: int) -> None:
    """Put this process under the supervision of its parent, and prepare it for its work.

    From then on it ignores Ctrl-C, is killed when its parent dies, and leads a process group and
    session of its own, so that what it starts can be ended with it. Call it once, first of all.

    Args:
        parent: process id of the parent; if that is dead already, this process ends at once.
    """
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
    """Set a property of this process, where the system is Linux."""
    if sys.platform == "linux":
        ctypes.CDLL(None).prctl(option, value)


def _guard(line: int) -> None:
    """Fork: only the child returns, and this process becomes its guard.

    The guard waits for the child, ends everything that the child has started, and then ends as the
    child did: with its exit code or of its signal. Where there are no subreapers and no ``/proc``,
    as on macOS, only the child's process group is ended.

    Args:
        line: descriptor of the socket, which is the child's alone.
    """
    awaited = {signal.SIGCHLD, signal.SIGTERM}
    signal.pthread_sigmask(signal.SIG_BLOCK, awaited)
    _prctl(_PR_SET_PDEATHSIG, signal.SIGTERM)
    _prctl(_PR_SET_CHILD_SUBREAPER, 1)  # what loses its parent gets this one
    guard = os.getpid()
    child = os.fork()
    if child == 0:
        signal.pthread_sigmask(signal.SIG_UNBLOCK, awaited)
        begin(guard)
        return

    # The guard lets go of the line and the terminal, which would else stay open with it.
    nothing = os.open(os.devnull, os.O_RDWR)
    for descriptor in (0, 1, 2, line):
        os.dup2(nothing, descriptor)
    code = None
    while code is None:
        if signal.sigwait(awaited) == signal.SIGTERM:
            os.kill(child, signal.SIGKILL)
        code = _reap(child)
    _end_descendants(child)
    if code < 0:
        _die_of(-code)
    os._exit(code)


def _die_of(number: int) -> None:
    """End this process by a signal, so that its parent sees how the child ended; no core dump."""
    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
    with contextlib.suppress(OSError):  # SIGKILL has no handler
        signal.signal(number, signal.SIG_DFL)
    signal.pthread_sigmask(signal.SIG_UNBLOCK, {number})
    os.kill(os.getpid(), number)


def _reap(child: int) -> int | None:
    """Collect the exit codes of dead children; return that of one of them, None while it lives.

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
    """End all that a dead child has started, until nothing is left.

    Its processes get SIGTERM at first, and SIGKILL after `_TERM_S`. They become children of this
    process, as it is their subreaper: no children left means done.
    """
    # Python's resource trackers are among them, and have to clean up, which SIGKILL prevents.
    number = signal.SIGTERM
    pause_s = _TERM_PAUSE_S
    until = time.monotonic() + _TERM_S
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
                number = signal.SIGKILL
                pause_s = _KILL_PAUSE_S


def descendants(pid: int) -> list[int]:
    """Return the processes that a process has started, and theirs, the oldest generation first.

    The kernel lists the children of each, so nothing is read that a process could have written, and
    it is fast enough for a chain of processes, each of which starts the next one and exits.
    """
    family = [pid]
    for process in family:  # which grows meanwhile
        with contextlib.suppress(OSError):  # it has ended meanwhile
            for thread in Path(f"/proc/{process}/task").iterdir():
                children = (thread / "children").read_bytes().split()
                family += map(int, children)
    return family[1:]
