"""Stop the arm when the control loop hangs."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable
from types import TracebackType
from typing import Self


class LoopWatchdog:
    """A thread that stops the arm if the control loop does not feed it in time. Real time only.

    Use as a context manager around the loop.

    Args:
        stop: holds the arm; called once, from another thread.
        timeout_s: longest time between two calls of `feed`.
    """

    def __init__(self, stop: Callable[[], None], timeout_s: float) -> None:
        self._stop, self._timeout_s = stop, timeout_s
        self._finished = threading.Event()
        self._last = time.monotonic()
        self._tripped_after: float | None = None
        self._thread = threading.Thread(target=self._watch, name="loop watchdog", daemon=True)

    def feed(self) -> None:
        """Report that the loop is running."""
        self._last = time.monotonic()

    @property
    def tripped_after(self) -> float | None:
        """Seconds without a report after which the arm was stopped; None if it was not."""
        return self._tripped_after

    def __enter__(self) -> Self:
        self.feed()
        self._thread.start()
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self._finished.set()
        self._thread.join()

    def _watch(self) -> None:
        while not self._finished.wait(max(self._last + self._timeout_s - time.monotonic(), 0.0)):
            silence = time.monotonic() - self._last
            if silence >= self._timeout_s:
                self._tripped_after = silence
                self._stop()
                return
