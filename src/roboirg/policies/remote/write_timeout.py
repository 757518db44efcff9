"""A time limit for sending."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager

LOOKS = 20
"""Within the limit; it may be overrun by the time between two."""
LONGEST_NAP = 1.0
"""Seconds between two looks."""


class WriteTimeout:
    """Gives up when a message has not been sent in time, by a thread of its own.

    The thread looks from time to time, because starting a timer with every message costs more than
    sending two pictures does.

    Args:
        seconds: that a message may take.
        give_up: is called by the thread; has to wake the one that sends.
    """

    def __init__(self, seconds: float, give_up: Callable[[], object]) -> None:
        self._seconds = seconds
        self._give_up = give_up
        self._due: float | None = None
        self._closed = threading.Event()
        threading.Thread(target=self._watch, name="send limit", daemon=True).start()

    @contextmanager
    def watching(self) -> Iterator[None]:
        """Within it a message is being sent."""
        self._due = time.monotonic() + self._seconds
        try:
            yield
        finally:
            self._due = None

    def close(self) -> None:
        """Have the thread end; may be called again."""
        self._closed.set()

    def _watch(self) -> None:
        nap = min(self._seconds / LOOKS, LONGEST_NAP)
        while not self._closed.wait(nap):
            due = self._due
            if due is not None and time.monotonic() > due:
                self._give_up()
                return
