"""Act when something takes too long, such as killing a process."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable
from typing import Self

_POLL_S = 0.25
"""How often a watch without a deadline looks for one."""


class DeadlineWatch:
    """A thread that acts when a deadline passes; use as a context manager. Real time only.

    Args:
        act: called once for each deadline that passes, from another thread.

    Attributes:
        acted_after: seconds after `begin` at which it has acted; None if it has not.
    """

    def __init__(self, act: Callable[[], None]) -> None:
        self._act = act
        self._finished, self._setting = threading.Event(), threading.Lock()
        self._began, self._deadline = 0.0, float("inf")
        self.acted_after: float | None = None
        self._thread = threading.Thread(target=self._watch, name="deadlines", daemon=True)

    def begin(self, limit_s: float | None) -> None:
        """Set the deadline to `limit_s` seconds from now, or remove it."""
        with self._setting:
            self._began = time.monotonic()
            self._deadline = float("inf") if limit_s is None else self._began + limit_s

    def __enter__(self) -> Self:
        self._thread.start()
        return self

    def __exit__(self, *_exception: object) -> None:
        self._finished.set()
        self._thread.join()

    def _watch(self) -> None:
        while not self._finished.wait(min(max(self._deadline - time.monotonic(), 0.0), _POLL_S)):
            # A deadline that is set meanwhile must not be taken for the one that passed.
            with self._setting:
                now = time.monotonic()
                has_passed = now >= self._deadline
                if has_passed:
                    self._deadline, self.acted_after = float("inf"), now - self._began
            if has_passed:
                self._act()
