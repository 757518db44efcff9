"""Shared-memory heartbeat from a worker process to its supervisor.

A process that hangs in a policy's native code cannot answer messages. So before each phase it
writes into shared memory which phase begins and its deadline.
"""

from __future__ import annotations

import contextlib
import time
from collections.abc import Iterator
from ctypes import c_double
from multiprocessing.context import SpawnContext
from typing import Literal, get_args

Phase = Literal[
    "worker startup",
    "environment",
    "wait for the policy's host",
    "policy's constructor",
    "policy's reset()",
    "policy's hear()",
    "policy's act()",
    "policy's close()",
]
PHASES: tuple[Phase, ...] = get_args(Phase)


class Watchdog:
    """Current phase of a process and its deadline, readable by another process.

    Times are from the monotonic clock, which all processes of a machine share.

    Args:
        context: creates the processes; pass the watchdog to a process when it is started.
    """

    def __init__(self, context: SpawnContext) -> None:
        self._shared = context.RawArray(c_double, 2)

    def write(self, phase: Phase, limit_s: float | None = None) -> None:
        """Write the phase that begins now.

        Args:
            phase: the phase.
            limit_s: how long it may take; None for no limit.
        """
        # Clear the deadline first: a reader must not combine it with another phase.
        self._shared[1] = 0.0
        self._shared[0] = PHASES.index(phase)
        self._shared[1] = 0.0 if limit_s is None else time.monotonic() + limit_s

    @property
    def phase(self) -> Phase:
        """The phase that began last."""
        return PHASES[int(self._shared[0])]

    @property
    def is_overdue(self) -> bool:
        """Whether the phase has exceeded its deadline."""
        return 0.0 < self._shared[1] < time.monotonic()


_watchdogs: list[Watchdog] = []
"""The watchdog of this process, if it is supervised."""


def use_watchdog(watchdog: Watchdog) -> None:
    """Let this process write its phases to a watchdog from now on."""
    _watchdogs[:] = [watchdog]


@contextlib.contextmanager
def watched(phase: Phase, limit_s: float | None = None) -> Iterator[None]:
    """Write that a phase begins, and remove its deadline afterwards."""
    for watchdog in _watchdogs:
        watchdog.write(phase, limit_s)
    try:
        yield
    finally:
        for watchdog in _watchdogs:
            watchdog.write("environment")
