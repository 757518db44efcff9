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
from typing import IO, Any, ClassVar, Literal, NamedTuple, get_args

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
    """The shared memory. Times are those of `Watchdog`; 0 stands for no time.

    Each is one number, so that none is read in part. At the end follows a number for each kind of
    native code: when a call of it began.
    """

    _fields_: ClassVar = [
        ("phase", ctypes.c_int),
        ("limit_s", ctypes.c_double),
        ("deadline", ctypes.c_double),
        ("queued_s", ctypes.c_double),
        ("queued_since", ctypes.c_double),
        ("awaited", ctypes.c_char * MAX_WAIT_LENGTH),
        *[(code, ctypes.c_double) for code in NATIVE],
    ]


class Overdue(NamedTuple):
    """A phase or native code that has exceeded its limit, in seconds."""

    phase: Phase | NativeCode
    limit_s: float


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
            file = _new_memory()
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
        """Write to the shared memory what this process waits for from now on; None for nothing.

        Time in a queue does not count for the time limit of the phase: when the wait ends, the
        deadline is moved by it.
        """
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
        self._shared.awaited = words[: MAX_WAIT_LENGTH - 1]  # C ends a text with a zero byte

    def write_native(self, code: NativeCode, since: float) -> None:
        """Write when a call of native code begins; 0 when it ends."""
        setattr(self._shared, code, since)

    @property
    def phase(self) -> Phase | NativeCode:
        """The native code that runs now, whatever the phase, or the phase that began last."""
        for code in NATIVE:
            if getattr(self._shared, code):
                return code
        return PHASES[int(self._shared.phase)]

    @property
    def awaited(self) -> str:
        """What the process waits for; empty if it has not reported."""
        return bytes(self._shared.awaited).decode("utf-8", "replace")

    @property
    def queued_s(self) -> float:
        """Seconds that the job has waited for its turn."""
        seconds = float(self._shared.queued_s)
        since = self._shared.queued_since
        if since:
            seconds += time.monotonic() - since
        return seconds

    @property
    def overdue(self) -> Overdue | None:
        """The phase or native code that has exceeded its time limit; None if none has.

        While native code runs (drawing or physics), only its own limit counts. In a queue, none
        does.
        """
        shared = self._shared
        now = time.monotonic()
        for code in NATIVE:
            since = getattr(shared, code)
            if since:
                return Overdue(code, NATIVE_LIMIT_S) if since < now - NATIVE_LIMIT_S else None
        if shared.queued_since:
            return None
        # The order matters, as the watched process writes meanwhile: at the end of a queue it moves
        # the deadline first. So if no queue was read above, the deadline read here has been moved.
        if not 0.0 < shared.deadline < now:
            return None
        return Overdue(PHASES[int(shared.phase)], float(shared.limit_s))


def _new_memory() -> IO[bytes]:
    """Return an open file without a name, filled with zeros, which processes can map as memory.

    It is not multiprocessing's shared memory, which is in /dev/shm: containers may lack that, or it
    is full.
    """
    if hasattr(os, "memfd_create"):  # not in every build of Python
        file: IO[bytes] = os.fdopen(os.memfd_create("roboirg"), "r+b", 0)
    else:
        file = TemporaryFile(buffering=0)  # noqa: SIM115 - is closed with the watchdog
    file.write(bytes(_Shared()))  # where a disk is full, this fails, and not a later look
    return file


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
    """Report a phase to this process's supervisor while the block runs, with its time limit.

    Afterwards the phase is the environment's, without a limit. Without a supervisor nothing is
    reported.
    """
    for watchdog in _watchdogs:
        watchdog.write(phase, limit_s)
    try:
        yield
    finally:
        for watchdog in _watchdogs:
            watchdog.write("environment")
