"""What a policy prints in an episode, in a file of bounded size next to the records.

The file is found by the slug of the episode's job, so records do not mention it. Output goes
straight into the file, not through a pipe: it is there after a crash, and a policy that prints
while it holds the interpreter's lock cannot wait for its own reader.
"""

from __future__ import annotations

import contextlib
import io
import os
import sys
import threading
from collections.abc import Iterator
from pathlib import Path
from types import TracebackType
from typing import Self

from roboirg.core.errors import RoboIRGError
from roboirg.core.handed_keys import bytes_without_keys

LOG_FOLDER = "logs"
LOG_SUFFIX = ".txt"
MAX_LOG_BYTES = 262_144
"""Size of a log; of longer output the beginning and the end are kept."""

_HEAD_SHARE = 0.5
_TAIL_SHARE = 0.25
"""What is kept of a log that is too long, of its largest size."""
_PERIOD_S = 0.25
"""How often the size is checked while a log is written."""
_NOTE = b"\n[roboirg: the middle of this log is left out]\n"
_DESCRIPTORS = (1, 2)
"""Descriptors of stdout and stderr."""


def log_path(folder: Path, slug: str) -> Path:
    """Return the path of an episode's log in the folder of its run."""
    return folder / LOG_FOLDER / f"{slug}{LOG_SUFFIX}"


def logged_slugs(folder: Path) -> frozenset[str]:
    """Return the names (slugs) of a run's episodes that have a log that is not empty.

    Read at once from the folder, as asking for each episode would be slow.
    """
    slugs = set()
    with contextlib.suppress(FileNotFoundError), os.scandir(folder / LOG_FOLDER) as entries:
        for entry in entries:
            is_log = entry.name.endswith(LOG_SUFFIX) and entry.is_file()
            if is_log and entry.stat().st_size:
                slugs.add(entry.name.removesuffix(LOG_SUFFIX))
    return frozenset(slugs)


class EpisodeLog:
    """The log of one episode, open for appending; use as a context manager.

    A file that stays empty is removed. An earlier log of the same episode is replaced.

    Args:
        path: of the file; its folder is created.
        limit: size of the file, bytes. It may be exceeded for a quarter of a second.

    Attributes:
        descriptor: of the file; all that is written to it is appended.

    Raises:
        RoboIRGError: the file cannot be created.
    """

    def __init__(self, path: Path, limit: int = MAX_LOG_BYTES) -> None:
        """Replace the file by an empty one; `__enter__` starts the thread that keeps it short."""
        self.path = path
        self._limit = limit
        self._finished = threading.Event()
        try:
            path.parent.mkdir(parents=True, exist_ok=True)
            path.unlink(missing_ok=True)
            self.descriptor = os.open(path, os.O_RDWR | os.O_CREAT | os.O_APPEND, 0o644)
        except OSError as error:
            raise RoboIRGError(f"Cannot write the log {path}: {error.strerror}.") from error
        self._thread = threading.Thread(target=self._watch, name="episode log", daemon=True)

    def trim(self) -> None:
        """Shorten the file if it is too long: beginning and end stay, with a note between them."""
        size = os.fstat(self.descriptor).st_size
        if size <= self._limit:
            return
        head_size = int(self._limit * _HEAD_SHARE)
        tail_size = int(self._limit * _TAIL_SHARE)
        tail = os.pread(self.descriptor, tail_size, size - tail_size)
        os.ftruncate(self.descriptor, head_size)
        os.write(self.descriptor, _NOTE + tail)

    def __enter__(self) -> Self:
        self._thread.start()
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        """Trim the file, remove keys of services from it, and delete it if it is empty.

        Then the file is closed. Errors of the disk are ignored: a log must not end a run.
        """
        self._finished.set()
        self._thread.join()
        # A policy may have closed the descriptor; its log must not end the run.
        with contextlib.suppress(OSError):
            self.trim()
            content = os.pread(self.descriptor, self._limit, 0)
            cleaned = bytes_without_keys(content)
            if cleaned != content:
                os.ftruncate(self.descriptor, 0)
                os.write(self.descriptor, cleaned)
            if not content:
                self.path.unlink(missing_ok=True)
            os.close(self.descriptor)

    def _watch(self) -> None:
        """Keep the log short until it is finished; runs in a thread."""
        with contextlib.suppress(OSError):
            while not self._finished.wait(_PERIOD_S):
                self.trim()


@contextlib.contextmanager
def logged_output(path: Path, limit: int = MAX_LOG_BYTES) -> Iterator[None]:
    """Write to a file what this process and its new children print while the block runs.

    Covers `print`, `logging`, warnings, and native code: the descriptors of stdout and stderr lead
    to the file. They are those of the whole process, so only one log can be open this way. At the
    end everything is undone in reverse order, after Python has written what it still holds.

    Args:
        path: of the file; an earlier one is replaced.
        limit: size of the file, bytes; the middle of longer output is left out.

    Raises:
        RoboIRGError: the file cannot be created.
    """
    with EpisodeLog(path, limit) as log, contextlib.ExitStack() as undo:
        flush_streams()
        for descriptor in _DESCRIPTORS:
            original = os.dup(descriptor)
            undo.callback(_restore, original, descriptor)
            os.dup2(log.descriptor, descriptor)
        for stream in (sys.stdout, sys.stderr):
            # A file is written in blocks, which a killed process would lose.
            if isinstance(stream, io.TextIOWrapper):
                undo.callback(_set_line_buffering, stream, stream.line_buffering)
                _set_line_buffering(stream, True)
        undo.callback(flush_streams)
        yield


def flush_streams() -> None:
    """Write what Python still holds of stdout and stderr."""
    for stream in (sys.stdout, sys.stderr):
        # A policy may have closed or replaced them.
        with contextlib.suppress(Exception):
            stream.flush()


def _set_line_buffering(stream: io.TextIOWrapper, wanted: bool) -> None:
    """Let a stream be written line by line, or in blocks; nothing if it is closed."""
    with contextlib.suppress(ValueError):  # closed
        stream.reconfigure(line_buffering=wanted)


def _restore(original: int, descriptor: int) -> None:
    """Let a descriptor lead to its original file again."""
    with contextlib.suppress(OSError):
        os.dup2(original, descriptor)
        os.close(original)
