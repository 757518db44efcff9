"""Shared-memory heartbeat from a worker process to its supervisor.

A process that hangs in a policy's native code cannot answer messages. So before each phase it
writes into shared memory which phase begins and its deadline.
"""

from __future__ import annotations

import contextlib
import ctypes
import time
from collections.abc import Iterator
from multiprocessing.sharedctypes import RawValue
from typing import ClassVar, Literal, get_args

from roboirg.core.waiting import Wait, listen

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


MAX_WAIT_LENGTH = 200
"""Most bytes of the words for what a process waits for."""


class _Shared(ctypes.Structure):
    _fields_: ClassVar = [
        ("phase", ctypes.c_int),
        ("limit_s", ctypes.c_double),
        ("deadline", ctypes.c_double),
        ("queued_s", ctypes.c_double),
        ("queued_since", ctypes.c_double),
        ("awaited", ctypes.c_char * MAX_WAIT_LENGTH),
    ]


class Watchdog:
    """Current phase of a process and its deadline, readable by another process.

    Times are from the monotonic clock, which all processes of a machine share. A deadline stands
    still while the process waits for its turn, as for a server that another episode uses.

    Pass it to a process when that is started.
    """

    def __init__(self) -> None:
        self._shared = RawValue(_Shared)

    def begin_job(self) -> None:
        """Forget how long the last job waited for its turn."""
        self._shared.queued_s = 0.0

    def write(self, phase: Phase, limit_s: float | None = None) -> None:
        """Write the phase that begins now.

        Args:
            phase: the phase.
            limit_s: how long it may take; None for no limit.
        """
        # Clear the deadline first: a reader must not combine it with another phase.
        self._shared.deadline = 0.0
        self._shared.phase = PHASES.index(phase)
        self._shared.awaited = b""
        self._shared.limit_s = 0.0 if limit_s is None else limit_s
        self._shared.deadline = 0.0 if limit_s is None else time.monotonic() + limit_s

    def write_wait(self, wait: Wait | None) -> None:
        """Write what is waited for from now on; None for nothing."""
        now = time.monotonic()
        if self._shared.queued_since:
            queued = now - self._shared.queued_since
            self._shared.queued_s += queued
            if self._shared.deadline:
                self._shared.deadline += queued
            self._shared.queued_since = 0.0
        if wait is not None and wait.is_queue:
            self._shared.queued_since = now
        words = b"" if wait is None else wait.what.encode("utf-8", "replace")
        self._shared.awaited = words[: MAX_WAIT_LENGTH - 1]

    @property
    def phase(self) -> Phase:
        """The phase that began last."""
        return PHASES[int(self._shared.phase)]

    @property
    def limit_s(self) -> float:
        """How long the phase may take; 0 without a limit."""
        return float(self._shared.limit_s)

    @property
    def awaited(self) -> str:
        """What the process waits for; empty if it has not reported."""
        return bytes(self._shared.awaited).decode("utf-8", "replace")

    @property
    def queued_s(self) -> float:
        """Seconds that the job has waited for its turn."""
        since = self._shared.queued_since
        return float(self._shared.queued_s + (time.monotonic() - since if since else 0.0))

    @property
    def is_overdue(self) -> bool:
        """Whether the phase has exceeded its deadline."""
        return not self._shared.queued_since and 0.0 < self._shared.deadline < time.monotonic()


_watchdogs: list[Watchdog] = []
"""The watchdog of this process, if it is supervised."""


def use_watchdog(watchdog: Watchdog) -> None:
    """Let this process write its phases, and what it waits for, to a watchdog from now on."""
    _watchdogs[:] = [watchdog]
    listen(watchdog.write_wait)


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
