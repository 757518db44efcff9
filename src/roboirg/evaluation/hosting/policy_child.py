"""One policy process, seen from its supervisor: start, exchange messages, end."""

from __future__ import annotations

import array
import fcntl
import json
import os
import select
import socket
import subprocess
import sys
import termios
import threading
from collections.abc import Mapping
from multiprocessing.connection import Connection
from typing import IO

from roboirg.evaluation.hosting.payload import MAX_MESSAGE, Message, decode, encode
from roboirg.records.record import ErrorKind
from roboirg.util.child_process import describe_exit, was_killed

GRACE_S = 2.0
"""How long a process may take to exit when it is asked to."""
MAX_OUTPUT = 256 * 2**10
"""Bytes that are kept of what a policy process prints in one call; the rest is read and dropped."""
DRAIN_S = 1.0
"""How long to wait for the end of what was printed; a thread of the policy may print for ever."""

# The first thing the process gets is the import path: nothing of the command is on its command
# line, and the script that started the run is not imported again.
_BOOT = (
    "import json, sys; sys.path[:] = json.loads(sys.argv[3]); "
    "from roboirg.evaluation.hosting.host_process import main; "
    "descriptor, parent = map(int, sys.argv[1:3]); sys.argv[1:] = []; main(descriptor, parent)"
)


class ChildLostError(Exception):
    """A policy process is gone.

    Attributes:
        kind: of the error, if the process did not end because of a time limit.
    """

    def __init__(self, kind: ErrorKind, message: str) -> None:
        super().__init__(message)
        self.kind = kind


class PolicyChild:
    """A policy process. Start it in a thread that lasts: the process dies with that thread.

    Args:
        variables: environment variables beside those of this process.
    """

    def __init__(self, variables: Mapping[str, str] | None = None) -> None:
        ours, theirs = socket.socketpair()
        with theirs:
            arguments = (str(theirs.fileno()), str(os.getpid()), json.dumps(sys.path))
            self._process = subprocess.Popen(  # noqa: S603 - our own module
                [sys.executable, "-c", _BOOT, *arguments],
                pass_fds=[theirs.fileno()],
                stdin=subprocess.DEVNULL,
                stdout=subprocess.PIPE,
                stderr=subprocess.STDOUT,
                env={**os.environ, **(variables or {})},
            )
        self._connection = Connection(ours.detach())
        self._output = _Output(self._process.stdout)

    @property
    def pid(self) -> int:
        """Its process id."""
        return self._process.pid

    def exchange(self, message: Message) -> Message:
        """Send a message and return the reply; waits for as long as it takes.

        Raises:
            ChildLostError: the process has died, or sent something other than a message.
        """
        try:
            self._connection.send_bytes(encode(message))
            return decode(self._connection.recv_bytes(MAX_MESSAGE))
        except (EOFError, OSError):
            raise self._lost() from None
        except ValueError as error:
            self.kill()
            raise ChildLostError("policy", f"the process sent {error}") from error

    def take_output(self) -> bytes:
        """Return what the process has printed since the last time, clipped."""
        return self._output.take()

    def loss(self) -> ChildLostError | None:
        """Return how the process died; None while it is alive."""
        code = self._process.poll()
        return None if code is None else _explain(code)

    def kill(self) -> None:
        """Kill the process; an exchange under way ends."""
        self._process.kill()

    def stop(self) -> None:
        """Let the process exit; kill it after `GRACE_S`."""
        self._connection.close()
        try:
            self._process.wait(GRACE_S)
        except subprocess.TimeoutExpired:
            self._process.kill()
            self._process.wait()

    def _lost(self) -> ChildLostError:
        """Return how the process died; one that only closed its connection is killed."""
        try:
            code = self._process.wait(GRACE_S)
        except subprocess.TimeoutExpired:
            self._process.kill()
            self._process.wait()
            return ChildLostError("policy", "the process closed its connection")
        return _explain(code)


def _explain(code: int) -> ChildLostError:
    return ChildLostError("infrastructure" if was_killed(code) else "policy", describe_exit(code))


class _Output:
    """Reads what a process prints, so that it never waits, and keeps a part of it.

    Args:
        stream: the read end of the pipe that is its stdout and stderr.
    """

    def __init__(self, stream: IO[bytes] | None) -> None:
        self._stream = stream
        self._changed = threading.Condition()
        self._kept, self._dropped = bytearray(), 0
        self._is_reading = False
        threading.Thread(target=self._read, name="policy output", daemon=True).start()

    def take(self) -> bytes:
        """Return what is kept, and forget it. Called when the process waits or has ended."""
        with self._changed:
            self._changed.wait_for(self._is_drained, DRAIN_S)
            output, dropped = bytes(self._kept), self._dropped
            self._kept.clear()
            self._dropped = 0
        note = f"\n[roboirg: {dropped:,} bytes of this call are left out]\n"
        return output + (note.encode() if dropped else b"")

    def _is_drained(self) -> bool:
        if self._stream is None or self._stream.closed:
            return True
        waiting = array.array("i", [0])
        fcntl.ioctl(self._stream.fileno(), termios.FIONREAD, waiting)
        return not (waiting[0] or self._is_reading)

    def _read(self) -> None:
        while self._stream is not None and select.select([self._stream], [], []):
            with self._changed:
                self._is_reading = True
            data = os.read(self._stream.fileno(), 65_536)
            with self._changed:
                room = max(MAX_OUTPUT - len(self._kept), 0)
                self._kept += data[:room]
                self._dropped += len(data[room:])
                self._is_reading = False
                self._changed.notify_all()
            if not data:
                return
