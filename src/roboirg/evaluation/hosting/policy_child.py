"""One policy process, seen from its supervisor."""

from __future__ import annotations

import array
import fcntl
import os
import select
import termios
import threading
from collections.abc import Mapping, Sequence
from typing import Any, Self

from roboirg.core.errors import RoboIRGError
from roboirg.evaluation.episode_errors import EpisodeLostError
from roboirg.evaluation.hosting.messages import (
    MAX_MESSAGE,
    Call,
    Outcome,
    Question,
    encode,
    read_child,
)
from roboirg.evaluation.records.record import ErrorKind
from roboirg.tasks.splits.private_splits import SALT_VARIABLE
from roboirg.util.child_process import ChildExit, ChildProcess

_MODULE = "roboirg.evaluation.hosting.host_process"

MAX_OUTPUT = 256 * 2**10
"""Bytes that are kept of what a policy process prints in one call; the rest is read and dropped."""
MAX_WORDS = 300
DRAIN_S = 1.0
"""How long to wait for the end of what was printed; a thread of the policy may print for ever."""


class PolicyChild(ChildProcess):
    """A policy process; made by `start`."""

    def __init__(self, *channel: Any) -> None:  # noqa: ANN401
        super().__init__(*channel)
        self._changed = threading.Condition()
        self._kept, self._dropped, self._is_reading = bytearray(), 0, False
        threading.Thread(target=self._read_output, name="policy output", daemon=True).start()

    @classmethod
    def start(cls, variables: Mapping[str, str] | None = None) -> Self:
        """Start a process with environment variables besides those of this one, without a salt."""
        return cls.run_module(_MODULE, {**(variables or {}), SALT_VARIABLE: None})

    def exchange(self, calls: Sequence[Call]) -> Question | list[Outcome]:
        """Send calls, or an answer, and return the reply; waits for as long as it takes.

        Raises:
            EpisodeLostError: the process has died, or sent something other than a message; whose
                fault that is, its host decides.
        """
        try:
            self.connection.send_bytes(encode(calls))
            reply: Question | list[Outcome] = read_child(self.connection.recv_bytes(MAX_MESSAGE))
            return reply
        except (EOFError, OSError):
            raise _explain(self.close()) from None
        except (RoboIRGError, RecursionError, ValueError) as error:
            self.end()
            words = f"the process sent what is no reply ({error})"
            raise EpisodeLostError("policy", words[:MAX_WORDS], alone=False) from None

    def loss(self) -> EpisodeLostError | None:
        """Return how the process died; None while it is alive."""
        return None if self.exit is None else _explain(self.exit)

    def take_output(self) -> bytes:
        """Return what it printed, and forget it. Called when it waits or has ended."""
        with self._changed:
            self._changed.wait_for(self._is_drained, DRAIN_S)
            output, dropped = bytes(self._kept), self._dropped
            self._kept.clear()
            self._dropped = 0
        note = f"\n[roboirg: {dropped:,} bytes of this call are left out]\n"
        return output + (note.encode() if dropped else b"")

    def _is_drained(self) -> bool:
        if self.output is None or self.output.closed:
            return True
        waiting = array.array("i", [0])
        fcntl.ioctl(self.output.fileno(), termios.FIONREAD, waiting)
        return not (waiting[0] or self._is_reading)

    def _read_output(self) -> None:
        """Read what it prints, so that it never waits, and keep a part of it."""
        while self.output is not None and select.select([self.output], [], []):
            with self._changed:
                self._is_reading = True
            data = os.read(self.output.fileno(), 65_536)
            with self._changed:
                room = max(MAX_OUTPUT - len(self._kept), 0)
                self._kept += data[:room]
                self._dropped += len(data[room:])
                self._is_reading = False
                self._changed.notify_all()
            if not data:
                return


def _explain(ended: ChildExit) -> EpisodeLostError:
    """Return the loss of a process that ended so."""
    kind: ErrorKind = "infrastructure" if ended.was_killed else "policy"
    return EpisodeLostError(kind, str(ended), alone=False)
