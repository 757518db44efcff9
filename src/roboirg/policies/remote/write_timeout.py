"""A time limit for sending a message."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager

CHECKS = 20
"""Per time limit, which may be exceeded by the time between two checks."""
MAX_PAUSE = 1.0
"""Seconds between two checks."""


class WriteTimeout:
    """Calls a function when a message is not sent in time, from a thread of its own.

    The thread polls, because starting a timer for each message costs more than sending two
    pictures.

    Args:
        seconds: limit for one message.
        on_timeout: called by the thread; must wake the thread that sends.
    """

    def __init__(self, seconds: float, on_timeout: Callable[[], object]) -> None:
        self._seconds = seconds
        self._on_timeout = on_timeout
        self._deadline: float | None = None
        self._closed = threading.Event()
        threading.Thread(target=self._watch, name="write timeout", daemon=True).start()

    @contextmanager
    def watching(self) -> Iterator[None]:
        """Limit the time of the block, which sends a message."""
        self._deadline = time.monotonic() + self._seconds
        try:
            yield
        finally:
            self._deadline = None

    def close(self) -> None:
        """End the thread; repeated calls do nothing."""
        self._closed.set()

    def _watch(self) -> None:
        pause = min(self._seconds / CHECKS, MAX_PAUSE)
        while not self._closed.wait(pause):
            deadline = self._deadline
            if deadline is not None and time.monotonic() > deadline:
                self._on_timeout()
                return
