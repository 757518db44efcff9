"""One policy process, seen from its supervisor."""

from __future__ import annotations

import array
import contextlib
import fcntl
import json
import os
import select
import signal
import socket
import subprocess
import sys
import termios
import threading
from collections.abc import Mapping, Sequence
from typing import IO, cast

from roboirg.core.errors import RoboIRGError
from roboirg.evaluation.episode_errors import EpisodeLostError
from roboirg.evaluation.hosting.messages import (
    MAX_MESSAGE,
    Call,
    Outcome,
    Question,
    read_child,
    receive,
    send,
)
from roboirg.evaluation.records.record import ErrorKind
from roboirg.tasks.splits.private_splits import SALT_VARIABLE
from roboirg.util.child_process import GRACE_S, ChildExit, without_interrupts
from roboirg.util.process_guard import descendants

# The first thing the interpreter gets is the import path.
_BOOT = (
    "import json, sys; sys.path[:] = json.loads(sys.argv.pop()); "
    "from roboirg.util.process_guard import run_main; run_main()"
)
_MODULE = "roboirg.evaluation.hosting.host_process"

GUARD_S = 5.0
"""How long a guard may take to end all that a policy has started."""
MAX_OUTPUT = 256 * 2**10
"""Bytes that are kept of what a policy process prints in one call; the rest is read and dropped."""
MAX_WORDS = 300
DRAIN_S = 1.0
"""How long to wait for the end of what a living process printed; a thread may print for ever."""


class PolicyChild:
    """A policy process in an interpreter that knows nothing of this one, and the line to it.

    The script and command line of this process are kept from it, and so is a private split's salt.
    A guard between the two ends, with the process, all that it has started; then our end of the
    line reads as end of file. The kernel ends both with the thread that starts them.

    Args:
        variables: environment variables besides those of this process.
    """

    def __init__(self, variables: Mapping[str, str] | None = None) -> None:
        self._line, theirs = socket.socketpair()
        environment = {**os.environ, **(variables or {})}
        environment.pop(SALT_VARIABLE, None)
        with theirs, without_interrupts():
            number = theirs.fileno()
            arguments = (str(number), str(os.getpid()), _MODULE, json.dumps(sys.path))
            self._guard = subprocess.Popen(  # noqa: S603 - our own interpreter
                [sys.executable, "-P", "-c", _BOOT, *arguments],
                pass_fds=[number],
                stdin=subprocess.DEVNULL,
                stdout=subprocess.PIPE,
                stderr=subprocess.STDOUT,
                env=environment,
            )
        self._output = cast("IO[bytes]", self._guard.stdout)
        self._changed = threading.Condition()
        self._kept, self._dropped, self._is_reading = bytearray(), 0, False
        for work in (self._read_output, self._hang_up):
            threading.Thread(target=work, name="policy process", daemon=True).start()

    @property
    def pid(self) -> int:
        return next(iter(descendants(self._guard.pid)), self._guard.pid)

    def exchange(self, calls: Sequence[Call]) -> Question | list[Outcome]:
        """Send calls, or an answer, and return the reply; waits for as long as it takes.

        Raises:
            EpisodeLostError: the process has died, or sent something other than a message; whose
                fault that is, its host decides.
        """
        try:
            send(self._line, calls)
            reply: Question | list[Outcome] = read_child(receive(self._line, MAX_MESSAGE))
            return reply
        except (EOFError, OSError):
            raise _explain(self._close()) from None
        except (RoboIRGError, RecursionError, ValueError) as error:
            self.end()
            words = f"the process sent no valid reply ({error})"
            raise EpisodeLostError("policy", words[:MAX_WORDS]) from None

    def loss(self, patience_s: float = 0.0) -> EpisodeLostError | None:
        """Return how the process died; None while it is alive.

        Args:
            patience_s: how long to wait for the guard of a process whose end of the line is closed.
        """
        code = self._wait(patience_s if self._has_hung_up() else 0.0)
        return None if code is None else _explain(ChildExit(code))

    def take_output(self, patience_s: float = DRAIN_S) -> bytes:
        """Return what it printed, and forget it. Called when it waits or has ended.

        Args:
            patience_s: how long to wait for the end of what was printed.
        """
        with self._changed:
            self._changed.wait_for(self._is_drained, patience_s)
            output, dropped = bytes(self._kept), self._dropped
            self._kept.clear()
            self._dropped = 0
        note = f"\n[roboirg: {dropped:,} bytes of this call are left out]\n"
        return output + (note.encode() if dropped else b"")

    def kill(self) -> None:
        """Let the guard kill all; if something has stopped it, kill it and them."""
        self._guard.terminate()
        if self._wait(GUARD_S) is None:
            for pid in descendants(self._guard.pid):
                with contextlib.suppress(OSError):
                    os.kill(pid, signal.SIGKILL)
        self._guard.kill()

    def end(self) -> None:
        """Kill the process at once, and forget it."""
        self.kill()
        self._close()

    def _close(self) -> ChildExit:
        """Let the process exit by closing its line; kill it after `GRACE_S`."""
        self._line.close()
        code = self._wait(GRACE_S)
        if code is None:
            self.kill()
            self._guard.wait()
        return ChildExit(code)

    def _wait(self, seconds: float) -> int | None:
        """Return the exit code of the guard, which is that of the process; None if it lives on."""
        with contextlib.suppress(subprocess.TimeoutExpired):
            self._guard.wait(seconds)
        return self._guard.poll()

    def _has_hung_up(self) -> bool:
        """Return whether the other end of the line is closed, and nothing of it is unread."""
        try:
            return not self._line.recv(1, socket.MSG_PEEK | socket.MSG_DONTWAIT)
        except BlockingIOError:
            return False
        except OSError:
            return True

    def _hang_up(self) -> None:
        """Close the line when the process has ended, even if others have its other end, too."""
        self._guard.wait()
        with contextlib.suppress(OSError):
            self._line.shutdown(socket.SHUT_RDWR)

    def _is_drained(self) -> bool:
        if self._output.closed:
            return True
        waiting = array.array("i", [0])
        fcntl.ioctl(self._output.fileno(), termios.FIONREAD, waiting)
        return not (waiting[0] or self._is_reading)

    def _read_output(self) -> None:
        """Read what it prints, so that it never waits, and keep a part of it."""
        while not self._output.closed:
            select.select([self._output], [], [])
            with self._changed:
                self._is_reading = True
            data = os.read(self._output.fileno(), 65_536)
            with self._changed:
                room = max(MAX_OUTPUT - len(self._kept), 0)
                self._kept += data[:room]
                self._dropped += len(data[room:])
                self._is_reading = False
                if not data:
                    self._output.close()
                self._changed.notify_all()


def _explain(ended: ChildExit) -> EpisodeLostError:
    """Return the loss of a process that ended so."""
    kind: ErrorKind = "infrastructure" if ended.was_killed else "policy"
    return EpisodeLostError(kind, str(ended))
