"""Time, real or virtual: the control loop asks nobody else what time it is."""

from __future__ import annotations

import time
from typing import Protocol


class Clock(Protocol):
    """Seconds since some moment, and waiting.

    Attributes:
        is_real: whether time passes by itself.
    """

    is_real: bool

    def now(self) -> float:
        """Seconds since some moment."""

    def wait_until(self, moment: float) -> None:
        """Return when it is that late; at once if it is already."""


class RealClock:
    """The machine's monotonic clock."""

    is_real = True

    def now(self) -> float:
        """Seconds since some moment."""
        return time.monotonic()

    def wait_until(self, moment: float) -> None:
        """Sleep until then."""
        while (left := moment - time.monotonic()) > 0:
            time.sleep(left)


class VirtualClock:
    """Time that passes only while somebody waits: as fast as possible, and exact."""

    is_real = False

    def __init__(self) -> None:
        self._now = 0.0

    def now(self) -> float:
        """Seconds since some moment."""
        return self._now

    def wait_until(self, moment: float) -> None:
        """It is that late now."""
        self._now = max(self._now, moment)
