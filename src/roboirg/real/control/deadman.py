"""The dead-man's time-out: if the control loop gives no sign of life, the arm is stopped."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable
from types import TracebackType
from typing import Self


class LoopWatchdog:
    """Stops an arm when nobody has said for a while that the loop is alive. Real time.

    Use as a context manager, with the loop inside.

    Args:
        stop: holds the arm; called from another thread, once.
        timeout_s: how long the loop may be silent.
    """

    def __init__(self, stop: Callable[[], None], timeout_s: float) -> None:
        self._stop, self._timeout_s = stop, timeout_s
        self._over = threading.Event()
        self._last = time.monotonic()
        self._tripped_after: float | None = None
        self._thread = threading.Thread(target=self._watch, name="dead-man", daemon=True)

    def feed(self) -> None:
        """The loop is alive."""
        self._last = time.monotonic()

    @property
    def tripped_after(self) -> float | None:
        """Seconds of silence after which the arm was stopped; None if it was not."""
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
        self._over.set()
        self._thread.join()

    def _watch(self) -> None:
        while not self._over.wait(max(self._last + self._timeout_s - time.monotonic(), 0.0)):
            silence = time.monotonic() - self._last
            if silence >= self._timeout_s:
                self._tripped_after = silence
                self._stop()
                return
