"""The ``roboirg`` command, also as ``python -m roboirg``."""

from __future__ import annotations

import os
import signal
from collections.abc import Callable
from types import FrameType


def main() -> None:
    """Run the command; before and after it, Ctrl-C ends the process at once."""
    _on_ctrl_c(_stop)
    from roboirg.main import main as run

    try:
        _on_ctrl_c(_interrupt)
        run()
    except BaseException as error:
        # Python 3.11 wraps what interrupts a class definition in a RuntimeError.
        if isinstance(error, KeyboardInterrupt) or isinstance(error.__cause__, KeyboardInterrupt):
            _stop()
        raise
    finally:
        _on_ctrl_c(_stop)


def _on_ctrl_c(handler: Callable[[int, FrameType | None], None]) -> None:
    """Set what Ctrl-C does, unless it is ignored, as in a shell's background."""
    if signal.getsignal(signal.SIGINT) is not signal.SIG_IGN:
        signal.signal(signal.SIGINT, handler)


def _interrupt(number: int, frame: FrameType | None) -> None:
    """Raise KeyboardInterrupt, but where Python's imports would lose it, stop at once."""
    if frame is not None and frame.f_code.co_filename == "<frozen importlib._bootstrap>":
        _stop()
    signal.default_int_handler(number, frame)


def _stop(*_signal: object) -> None:
    # Exceptions are lost, or printed, where callbacks, C code or the end of Python are interrupted.
    os.write(2, b"roboirg: stopped.\n")
    os._exit(128 + signal.SIGINT)


if __name__ == "__main__":
    main()
