"""Real and virtual time for the control loop."""

from __future__ import annotations

import time
from typing import Protocol


class Clock(Protocol):
    """A monotonic clock that can be waited for.

    Attributes:
        is_real: whether time passes by itself.
    """

    is_real: bool

    def now(self) -> float:
        """Return the time, seconds since an arbitrary start."""

    def wait_until(self, moment: float) -> None:
        """Return at that time; at once if it has passed."""


class RealClock:
    """The machine's monotonic clock."""

    is_real = True

    def now(self) -> float:
        return time.monotonic()

    def wait_until(self, moment: float) -> None:
        """Sleep until that time."""
        while (left := moment - time.monotonic()) > 0:
            time.sleep(left)


class VirtualClock:
    """A clock that advances only in `wait_until`: as fast as possible, and exact."""

    is_real = False

    def __init__(self) -> None:
        self._now = 0.0

    def now(self) -> float:
        return self._now

    def wait_until(self, moment: float) -> None:
        """Advance to that time."""
        self._now = max(self._now, moment)
