"""Ctrl-C and SIGTERM end a run, also where Python loses the exception."""

from __future__ import annotations

import signal
from collections.abc import Callable
from types import FrameType


class Interruption:
    """Turns SIGINT and SIGTERM into KeyboardInterrupt, and remembers them.

    Python drops what is raised in finalizers and in callbacks of libraries. An arm must not move on
    because of that, so the control loop asks again in each period.
    """

    def __init__(self) -> None:
        self._came = False

    def watch(self) -> None:
        """Handle the signals from now on, in the main thread; an ignored SIGINT stays ignored."""
        signal.signal(signal.SIGTERM, self._handle)
        if signal.getsignal(signal.SIGINT) is not signal.SIG_IGN:
            signal.signal(signal.SIGINT, self._handle)

    def before(self, requested: Callable[[], bool]) -> Callable[[], bool]:
        """Return a function that raises KeyboardInterrupt after a signal, else asks `requested`."""

        def ask() -> bool:
            if self._came:
                raise KeyboardInterrupt
            return requested()

        return ask

    def _handle(self, _number: int, _frame: FrameType | None) -> None:
        self._came = True
        raise KeyboardInterrupt
