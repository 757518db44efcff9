"""Pass records on as they are stored: a function, or a command's standard input."""

from __future__ import annotations

import contextlib
import queue
import shlex
import shutil
import subprocess
import threading
from collections.abc import Callable
from types import TracebackType
from typing import Self

from roboirg.core.errors import InvalidValueError
from roboirg.evaluation.records.record import Record
from roboirg.evaluation.records.record_codec import encode
from roboirg.evaluation.run.progress import Reporter

MOST_WAITING = 1000
"""Records that a slow command may leave unread before it is given up."""
CLOSE_S = 30.0
"""Seconds that a command has for the rest when a run ends."""

RecordFunction = Callable[[Record], object]


def split_command(text: str) -> list[str]:
    """Return a command as words.

    Raises:
        InvalidValueError: it is empty, has an open quote, or its program does not exist.
    """
    try:
        words = shlex.split(text)
    except ValueError as error:
        raise InvalidValueError(f"The command {text!r} cannot be read: {error}.") from error
    if not words or shutil.which(words[0]) is None:
        name = words[0] if words else ""
        raise InvalidValueError(
            f"--on-record {text!r}: there is no program {name!r}; give a command that reads one "
            "record per line, such as 'python tracker.py'."
        )
    return words


class CommandHook:
    """Writes each record as a line of JSON to a command, which is started once.

    The command runs during the run: a thread writes, so that a slow command delays nothing.
    """

    def __init__(self, command: str) -> None:
        self._words = split_command(command)
        self._lines: queue.Queue[bytes | None] = queue.Queue(MOST_WAITING)
        self._failure = ""
        # In a session of its own: Ctrl-C stops the run, and the command may finish.
        self._process = subprocess.Popen(  # noqa: S603 - the user's own command
            self._words, stdin=subprocess.PIPE, start_new_session=True
        )
        self._thread = threading.Thread(target=self._write, daemon=True)
        self._thread.start()

    def __call__(self, record: Record) -> None:
        """Hand a record on.

        Raises:
            RuntimeError: the command has ended, or is far behind.
        """
        if self._failure:
            raise RuntimeError(self._failure)
        try:
            self._lines.put_nowait(encode(record) + b"\n")
        except queue.Full:
            raise RuntimeError(f"it has not read {MOST_WAITING:,} records") from None

    def close(self) -> None:
        """Let the command read the rest and end; it is killed if it takes too long.

        Raises:
            RuntimeError: it failed, or did not end.
        """
        with contextlib.suppress(queue.Full):
            self._lines.put(None, timeout=CLOSE_S)
        self._thread.join(CLOSE_S)
        try:
            code = self._process.wait(CLOSE_S if not self._thread.is_alive() else 0)
        except subprocess.TimeoutExpired:
            self._process.kill()
            self._process.wait()
            raise RuntimeError(f"it did not end within {CLOSE_S:.0f} s and was killed") from None
        if code:
            raise RuntimeError(f"it ended with exit code {code}")
        if self._failure:
            raise RuntimeError(self._failure)

    def _write(self) -> None:
        assert self._process.stdin is not None  # noqa: S101 - it is a pipe
        try:
            while (line := self._lines.get()) is not None:
                self._process.stdin.write(line)
                self._process.stdin.flush()
        except OSError:
            self._failure = "it ended before the run"
        with contextlib.suppress(OSError):
            self._process.stdin.close()


class HookedReporter(Reporter):
    """Passes a run's progress on, and its records to a hook, whose failures are reported once.

    Args:
        reporter: shows the progress.
        hook: gets every record that is stored, in this process.
    """

    def __init__(self, reporter: Reporter, hook: RecordFunction) -> None:
        self._reporter, self._hook = reporter, hook
        self._works = True

    def start(self, total: int, done: int) -> None:
        self._reporter.start(total, done)

    def advance(self, record: Record, *, is_new: bool = True) -> None:
        """Pass it on, and call the hook unless it has failed before."""
        self._reporter.advance(record, is_new=is_new)
        if self._works:
            self._attempt(lambda: self._hook(record))

    def warn(self, text: str) -> None:
        self._reporter.warn(text)

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self,
        _kind: type[BaseException] | None,
        _error: BaseException | None,
        _traceback: TracebackType | None,
    ) -> None:
        if isinstance(self._hook, CommandHook):
            self._attempt(self._hook.close)

    def _attempt(self, act: Callable[[], object]) -> None:
        try:
            act()
        except Exception as error:  # noqa: BLE001 - whatever a hook raises must not end the run
            if self._works:
                self._reporter.warn(
                    f"The receiver of records failed ({type(error).__name__}: {error}); it "
                    "receives no more records of this run. All records are stored."
                )
            self._works = False
