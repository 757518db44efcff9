"""What a worker process is at, told to whoever supervises it, without a message.

A process that hangs in a policy's native code answers nothing any more. So it notes beforehand, in
memory that it shares with its supervisor, what it begins and until when that may take.
"""

from __future__ import annotations

import contextlib
import time
from collections.abc import Iterator
from ctypes import c_double
from multiprocessing.context import SpawnContext
from typing import Literal, get_args

Phase = Literal[
    "start",
    "world",
    "policy's constructor",
    "policy's reset()",
    "policy's act()",
    "policy's close()",
]
PHASES: tuple[Phase, ...] = get_args(Phase)


class Watchdog:
    """A note of one process for another: the phase, and until when it may take.

    Times are those of the machine's monotonic clock, which its processes share.

    Args:
        context: of the processes; the board has to be handed over when one is started.
    """

    def __init__(self, context: SpawnContext) -> None:
        self._note = context.RawArray(c_double, 2)

    def write(self, phase: Phase, limit_s: float | None = None) -> None:
        """Note what begins now.

        Args:
            phase: what it is.
            limit_s: how long it may take; None for no limit of its own.
        """
        # No deadline while the two numbers do not belong together.
        self._note[1] = 0.0
        self._note[0] = PHASES.index(phase)
        self._note[1] = 0.0 if limit_s is None else time.monotonic() + limit_s

    @property
    def phase(self) -> Phase:
        """What was noted last."""
        return PHASES[int(self._note[0])]

    @property
    def is_overdue(self) -> bool:
        """Whether it has taken longer than it may."""
        return 0.0 < self._note[1] < time.monotonic()


_watchdogs: list[Watchdog] = []
"""That of this process, if it is supervised."""


def use_watchdog(board: Watchdog) -> None:
    """From now on this process is supervised by means of this board."""
    _watchdogs[:] = [board]


@contextlib.contextmanager
def watched(phase: Phase, limit_s: float | None = None) -> Iterator[None]:
    """Note that a phase begins, and afterwards that its limit is over."""
    for board in _watchdogs:
        board.write(phase, limit_s)
    try:
        yield
    finally:
        for board in _watchdogs:
            board.write("world")
