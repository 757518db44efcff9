"""Shared-memory heartbeat from a worker process to its supervisor.

A process that hangs in native code cannot answer messages, nor run a thread of its own if that code
keeps Python's lock. So before each phase it writes into shared memory which phase begins and its
deadline, and before each picture and each control step's physics that it begins.
"""

from __future__ import annotations

import contextlib
import ctypes
import mmap
import os
import time
from collections.abc import Iterator
from multiprocessing.reduction import DupFd
from tempfile import TemporaryFile
from typing import IO, Any, ClassVar, Literal, get_args

from roboirg.core.waiting import NativeCode, Wait, listen

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
NATIVE: tuple[NativeCode, ...] = get_args(NativeCode)

NATIVE_LIMIT_S = 120.0
"""How long one picture, or the physics of one control step, may take: on a busy machine without a
GPU they take seconds at most, and only a driver or a library that hangs takes this long."""

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
        # When such a call began; 0 outside. One number each, so that none is read in part.
        *((code, ctypes.c_double) for code in NATIVE),
    ]


class Watchdog:
    """Current phase of a process and its deadline, readable by another process.

    Times are from the monotonic clock, which all processes of a machine share. A deadline stands
    still while the process waits for its turn, as for a server that another episode uses.

    Pass it to a process when that is started.

    Args:
        file: of the memory, which another process made; None makes it.
    """

    def __init__(self, file: IO[bytes] | None = None) -> None:
        if file is None:
            # Not multiprocessing's memory, which is in /dev/shm: containers lack that, or it is
            # full. Not every build of Python has memfd_create.
            file = (
                os.fdopen(os.memfd_create("roboirg"), "r+b", 0)
                if hasattr(os, "memfd_create")
                else TemporaryFile(buffering=0)  # noqa: SIM115 - is closed with this object
            )
            file.write(bytes(_Shared()))  # where a disk is full, this fails, and not a later look
        self._file = file
        self._shared = _Shared.from_buffer(mmap.mmap(file.fileno(), ctypes.sizeof(_Shared)))

    def __reduce__(self) -> tuple[Any, ...]:
        return _attach, (DupFd(self._file.fileno()),)

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

    def write_native(self, code: NativeCode, since: float) -> None:
        """Write when a call of native code begins; 0 when it ends."""
        setattr(self._shared, code, since)

    @property
    def phase(self) -> Phase | NativeCode:
        """The native code that runs now, whatever the phase, or the phase that began last."""
        native = (code for code in NATIVE if getattr(self._shared, code))
        return next(native, PHASES[int(self._shared.phase)])

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
    def overdue(self) -> tuple[Phase | NativeCode, float] | None:
        """The phase that has exceeded its limit, and the limit in seconds; None if none has.

        While native code of the environment runs, only its own limit counts.
        """
        shared, now = self._shared, time.monotonic()
        for code in NATIVE:
            if since := getattr(shared, code):
                return (code, NATIVE_LIMIT_S) if since < now - NATIVE_LIMIT_S else None
        is_overdue = not shared.queued_since and 0.0 < shared.deadline < now
        return (PHASES[shared.phase], float(shared.limit_s)) if is_overdue else None


def _attach(descriptor: Any) -> Watchdog:  # noqa: ANN401 - multiprocessing's, of no public type
    return Watchdog(os.fdopen(descriptor.detach(), "r+b", 0))


_watchdogs: list[Watchdog] = []
"""The watchdog of this process, if it is supervised."""


def use_watchdog(watchdog: Watchdog) -> None:
    """Let this process write its phases, waits and native calls to a watchdog from now on."""
    _watchdogs[:] = [watchdog]
    listen(watchdog.write_wait, watchdog.write_native)


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
