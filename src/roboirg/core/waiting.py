"""What a policy waits for, told to those who measure and limit its time.

Time in a queue, as for a server that another episode uses, is not the policy's own.
"""

from __future__ import annotations

import contextlib
import time
from collections.abc import Callable, Iterator
from typing import NamedTuple


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

_listeners: list[WaitListener] = []
_waits: list[Wait] = []
_queued = [0.0]
"""Seconds that this process has waited for its turn."""


@contextlib.contextmanager
def waiting(what: str, *, is_queue: bool = False) -> Iterator[None]:
    """Report what this process waits for while the block runs, in words to follow "waiting for".

    `is_queue`: it waits for its turn, which is not the policy's own time.
    """
    wait = Wait(what, is_queue, time.monotonic())
    _waits.append(wait)
    _tell()
    try:
        yield
    finally:
        _waits.remove(wait)
        if is_queue:
            _queued[0] += time.monotonic() - wait.since
        _tell()


def listen(listener: WaitListener) -> None:
    """Report to a listener, from now on, all waits that begin and end in this process."""
    _listeners.append(listener)


def queued_seconds() -> float:
    """Return how long this process has waited for its turn so far."""
    return _queued[0]


def _tell() -> None:
    for listener in _listeners:
        listener(_waits[-1] if _waits else None)
