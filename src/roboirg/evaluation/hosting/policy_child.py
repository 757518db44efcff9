"""One policy process, seen from its supervisor."""

from __future__ import annotations

import array
import fcntl
import os
import select
import termios
import threading
from collections.abc import Mapping
from typing import IO, Self

from roboirg.evaluation.hosting.payload import MAX_MESSAGE, Message, decode, encode
from roboirg.evaluation.records.record import ErrorKind
from roboirg.tasks.splits.private_splits import SALT_VARIABLE
from roboirg.util.child_process import ChildExit, ChildProcess

_MODULE = "roboirg.evaluation.hosting.host_process"

MAX_OUTPUT = 256 * 2**10
"""Bytes that are kept of what a policy process prints in one call; the rest is read and dropped."""
DRAIN_S = 1.0
"""How long to wait for the end of what was printed; a thread of the policy may print for ever."""


class ChildLostError(Exception):
    """A policy process is gone.

    Attributes:
        kind: of the error, if the process did not end because of a time limit.
    """

    def __init__(self, kind: ErrorKind, message: str) -> None:
        super().__init__(message)
        self.kind = kind


class PolicyChild(ChildProcess):
    """A policy process; made by `start`.

    Attributes:
        printed: what it prints.
    """

    printed: _Output

    @classmethod
    def start(cls, variables: Mapping[str, str] | None = None) -> Self:
        """Start a process with environment variables beside those of this one, without a salt."""
        child = cls.run_module(_MODULE, {**(variables or {}), SALT_VARIABLE: None})
        child.printed = _Output(child.output)
        return child

    def exchange(self, message: Message) -> Message:
        """Send a message and return the reply; waits for as long as it takes.

        Raises:
            ChildLostError: the process has died, or sent something other than a message.
        """
        try:
            self.connection.send_bytes(encode(message))
            return decode(self.connection.recv_bytes(MAX_MESSAGE))
        except (EOFError, OSError):
            raise _explain(self.close()) from None
        except ValueError as error:
            self.kill()
            raise ChildLostError("policy", f"the process sent {error}") from error

    def loss(self) -> ChildLostError | None:
        """Return how the process died; None while it is alive."""
        return None if self.exit is None else _explain(self.exit)


def _explain(ended: ChildExit) -> ChildLostError:
    return ChildLostError("infrastructure" if ended.was_killed else "policy", str(ended))


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
