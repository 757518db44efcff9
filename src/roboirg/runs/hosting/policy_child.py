"""One policy process, seen from its supervisor."""

from __future__ import annotations

import contextlib
import fcntl
import json
import os
import select
import signal
import socket
import subprocess
import sys
import threading
import time
import weakref
from collections.abc import Mapping
from multiprocessing.connection import wait
from tempfile import TemporaryFile

from roboirg.records.record import ErrorKind
from roboirg.runs.hosting.messages import (
    DRAW_S,
    MAX_OUTPUT,
    HostRequest,
    Loss,
    ask,
    take_output,
)
from roboirg.util.child_process import GRACE_S, ChildExit, without_interrupts
from roboirg.util.process_guard import descendants

# The first thing the interpreter gets is the import path.
_BOOT = (
    "import json, sys; sys.path[:] = json.loads(sys.argv.pop()); "
    "from roboirg.util.process_guard import run_main; run_main()"
)
_MODULE = "roboirg.runs.hosting.host_process"

GUARD_S = 5.0
"""How long a guard may take to end all that a policy has started."""
MARGIN_S = 1.0
"""How much longer a check waits than a call may take: the call that hangs is named first."""
PERIOD_S = 0.25
"""How often the size of its output is checked."""


class _LifeCheck:
    """Asks a policy's process whether it hangs; it answers only between two calls of the policy.

    The other half, which answers, is `roboirg.runs.hosting.host_process`.

    Args:
        line: to the process, on which it also sends a byte when it has started.
    """

    def __init__(self, line: socket.socket) -> None:
        self._line = line
        self._asking = threading.Lock()
        self._answered_at = 0.0
        self._has_started = False

    def passes(self, limit_s: float) -> bool:
        """Return whether the process answers in time; False, too, if it has ended.

        Several threads may call this. They share the line, so they ask one after the other; one
        that waited for its turn takes an answer that came meanwhile as its own, and asks nothing.

        Args:
            limit_s: seconds that a call may take, and so the answer.
        """
        called_at = time.monotonic()
        with self._asking, contextlib.suppress(OSError):
            return self._answered_at > called_at or self._answers(limit_s)
        return False

    def _answers(self, limit_s: float) -> bool:
        """Ask the process, and return whether it answers in time. Only one thread may ask at once.

        The question is the request ``check``, the answer any byte. A process that has not started
        yet gets at least `GRACE_S` to answer.
        """
        # What it has sent before it is asked is no answer; it only shows that it has started.
        if wait([self._line], 0.0) and self._line.recv(MAX_OUTPUT):
            self._has_started = True
        ask(self._line, HostRequest("check"))
        patience_s = limit_s + MARGIN_S
        if not self._has_started:
            patience_s = max(limit_s, GRACE_S)
        if not wait([self._line], patience_s):
            return False
        answer = self._line.recv(1)  # empty if the process has ended
        if answer:
            self._answered_at = time.monotonic()
        return bool(answer)


class PolicyChild:
    """A policy process in an interpreter that knows nothing of this one, and the line to it.

    The script and command line of this process are kept from it. A guard between the two ends, with
    the process, all that it has started. The kernel ends both with the thread that starts them.

    Args:
        environment: its environment variables.

    Attributes:
        worlds: how many it serves.
    """

    def __init__(self, environment: Mapping[str, str]) -> None:
        self.worlds = 0
        self._most_worlds = 0
        self._fault: str | None = None
        self._was_ended = False
        self._output = _new_output()
        weakref.finalize(self, os.close, self._output)
        self._line, theirs = socket.socketpair()
        self._line.settimeout(GRACE_S)  # for one that reads nothing
        weakref.finalize(self, self._line.close)  # not before: another thread may wait for it
        self._life_check = _LifeCheck(self._line)
        with theirs, without_interrupts():
            number = theirs.fileno()
            arguments = (str(number), str(os.getpid()), _MODULE, json.dumps(sys.path))
            self._guard = subprocess.Popen(  # noqa: S603 - our own interpreter
                [sys.executable, "-P", "-c", _BOOT, *arguments],
                pass_fds=[number],
                stdin=subprocess.DEVNULL,
                stdout=self._output,
                stderr=self._output,
                env=environment,
            )
        threading.Thread(target=self._bound_output, name="policy output", daemon=True).start()

    def serve(self, passed: socket.socket, batch: int) -> None:
        """Let it serve a world at the other end of a line, which ends if it has just died.

        Args:
            passed: its end of the line.
            batch: most episodes that are asked about together.
        """
        self._most_worlds = max(self._most_worlds, self.worlds)
        with contextlib.suppress(OSError):
            ask(self._line, HostRequest("open", batch=batch), passed)

    def check(self, limit_s: float) -> float | None:
        """Kill the process if it hangs: if it does not come to the end of its call in time.

        Args:
            limit_s: how long a call may take.

        Returns:
            How long, in seconds, a call may wait for its turn in all; None if the process is over.
            The process carries out the call that has waited longest, so at most one call of each
            world comes first, and each may take its limit and the time in which its world draws.
        """
        if self._life_check.passes(limit_s):
            return self._most_worlds * (limit_s + DRAW_S)
        if not self.is_over:
            self._fault = f"the process began no call within {limit_s:g} s"
            self.kill()
        return None

    @property
    def is_over(self) -> bool:
        """Whether it has died; waits for the guard of one that has hung up."""
        poll = select.poll()
        poll.register(self._line, 0)  # for nothing but its end
        has_hung_up = bool(poll.poll(0))
        return self._wait(GRACE_S if has_hung_up else 0.0) is not None

    def loss(self) -> Loss:
        """End the process, and return how it ended: kind of error, words, and what it printed.

        It exits when its line is closed; after `GRACE_S` it is killed.
        """
        # Read first, as `kill` sets it: whether another world has had the process killed before.
        was_ended = self._was_ended
        with contextlib.suppress(OSError):
            self._line.shutdown(socket.SHUT_RDWR)
        if self._wait(GRACE_S) is None:
            self.kill()
            self._guard.wait()
        output = take_output(self._output, keep=True)  # several worlds may ask
        if self._fault is not None:
            return Loss("timeout", self._fault, output, was_ended)
        own_end = ChildExit(None if self._was_ended else self._guard.returncode)
        words = "another episode broke the process" if was_ended else str(own_end)
        kind: ErrorKind = "infrastructure" if own_end.was_killed else "policy"
        return Loss(kind, words, output, was_ended)

    def kill(self) -> None:
        """Let the guard process kill the policy's process and all that it has started.

        If the guard does not end in time, all of them are killed from here, and so is the guard.
        """
        self._was_ended = True
        self._guard.terminate()
        self._guard.send_signal(signal.SIGCONT)  # a stopped process obeys only when it goes on
        if self._wait(GUARD_S) is None:
            for pid in descendants(self._guard.pid):
                with contextlib.suppress(OSError):
                    os.kill(pid, signal.SIGKILL)
        self._guard.kill()

    def end(self) -> None:
        """Kill the process at once, and forget it."""
        self.kill()
        self.loss()

    def _wait(self, seconds: float) -> int | None:
        """Return the exit code of the guard, which is that of the process; None if it lives on."""
        with contextlib.suppress(subprocess.TimeoutExpired):
            self._guard.wait(seconds)
        return self._guard.poll()

    def _bound_output(self) -> None:
        """Keep the file with the process's output small, as long as the process lives.

        Output is taken after each call; this is for a call that prints without end.
        """
        while self._guard.poll() is None:
            time.sleep(PERIOD_S)
            if os.fstat(self._output).st_size > 2 * MAX_OUTPUT:
                os.ftruncate(self._output, MAX_OUTPUT + 1)


def _new_output() -> int:
    """Return the descriptor of a file for what a process prints; its writers append.

    The file has no name: a path would name the run.
    """
    if sys.platform == "linux":
        output = os.memfd_create("output")
    else:
        with TemporaryFile() as file:
            output = os.dup(file.fileno())
    fcntl.fcntl(output, fcntl.F_SETFL, os.O_APPEND)
    return output
