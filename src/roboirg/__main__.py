"""The ``roboirg`` command, also as ``python -m roboirg``."""

from __future__ import annotations

import os
import signal
from types import FrameType


def main() -> None:
    """Run the command; before and after it, Ctrl-C ends the process at once."""
    is_handled = signal.getsignal(signal.SIGINT) is not signal.SIG_IGN
    if is_handled:
        signal.signal(signal.SIGINT, _stop)
    from roboirg.main import main as run

    try:
        if is_handled:
            signal.signal(signal.SIGINT, _interrupt)
        run()
    except BaseException as error:
        # Python 3.11 wraps what interrupts a class definition in a RuntimeError.
        if isinstance(error, KeyboardInterrupt) or isinstance(error.__cause__, KeyboardInterrupt):
            _stop()
        raise
    finally:
        if is_handled:
            signal.signal(signal.SIGINT, _stop)


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
