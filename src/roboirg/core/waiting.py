"""What a policy or a world waits for, reported to those who measure and limit its time.

Time in a queue, as for a server that another episode uses, is not the policy's own. A call of the
simulator's native code may never return, as a graphics driver may hang.
"""

from __future__ import annotations

import contextlib
import time
from collections.abc import Callable, Iterator
from typing import Literal, NamedTuple


class Wait(NamedTuple):
    """Something that is waited for.

    Attributes:
        what: in words, to follow "waiting for".
        is_queue: whether this is waiting for one's turn, which is not the policy's own time.
        since: when it began, seconds of the monotonic clock.
    """

    what: str
    is_queue: bool
    since: float


WaitListener = Callable[[Wait | None], None]
"""Called when a wait begins, and with None or the wait around it when it ends."""

NativeCode = Literal["drawing", "physics"]
"""Native code of the simulator, which has no time limit of its own."""

_listeners: list[WaitListener] = []
_native_listeners: list[Callable[[NativeCode, float], None]] = []
_waits: list[Wait] = []
_queued = [0.0]
"""Seconds that this process has waited for its turn: one number, in a list to be changed."""


@contextlib.contextmanager
def waiting(what: str, *, is_queue: bool = False) -> Iterator[None]:
    """Report what this process waits for while the block runs, in words to follow "waiting for".

    With `is_queue`, it waits for its turn, which is not the policy's own time, and the seconds are
    added to those of `queued_seconds`. Waits may be nested; the innermost is reported.
    """
    wait = Wait(what, is_queue, time.monotonic())
    _waits.append(wait)
    _report()
    try:
        yield
    finally:
        _waits.remove(wait)
        if is_queue:
            _queued[0] += time.monotonic() - wait.since
        _report()


class NativeCall(NamedTuple):
    """Context in which native code is reported to run; cheap, as every control step has one.

    Not inside another of its kind, whose end would be reported too early.
    """

    code: NativeCode

    def __enter__(self) -> None:
        for listener in _native_listeners:
            listener(self.code, time.monotonic())

    def __exit__(self, *_error: object) -> None:
        for listener in _native_listeners:
            listener(self.code, 0.0)


DRAWING = NativeCall("drawing")
PHYSICS = NativeCall("physics")


def listen(listener: WaitListener, native: Callable[[NativeCode, float], None]) -> None:
    """Report all waits, and all calls of native code, in this process from now on.

    Args:
        listener: gets the waits.
        native: gets the time of the monotonic clock when a call begins, and 0 when it ends.
    """
    _listeners.append(listener)
    _native_listeners.append(native)


def queued_seconds() -> float:
    """Return how long this process has waited for its turn so far."""
    return _queued[0]


def _report() -> None:
    """Report the innermost wait, or that there is none."""
    wait = _waits[-1] if _waits else None
    for listener in _listeners:
        listener(wait)
