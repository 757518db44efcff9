"""Files of JSON lines that are only appended to, and survive that their writer is killed.

- When `AppendFile.extend` returns, its lines are on the disk (one write each, then fsync).
- Killing the process at any moment loses at most lines whose `extend` has not returned. A torn last
  line is never read; the next writer moves it to a file of its own (copied and synced there before
  it is removed here).
- There is one writer at a time: the lock is the kernel's (`flock`), so it is released when its
  owner dies and never goes stale.
"""

from __future__ import annotations

import contextlib
import functools
import json
import logging
import os
from collections.abc import Callable, Iterable, Iterator
from pathlib import Path
from typing import BinaryIO, NamedTuple, TypeVar

from roboirg.core.errors import InvalidValueError
from roboirg.core.plain_text import counted
from roboirg.records.record_codec import DamagedLineError, StoreError
from roboirg.records.run_files import refuse_links
from roboirg.util.atomic_write import sync_to_disk, take_lock
from roboirg.util.regular_file import open_regular

LOCK_FILE = ".lock"
MOST_BYTES = 64 << 20
"""Of a line with its newline; a file with a longer one is refused."""

Parsed = TypeVar("Parsed")


class LinePlace(NamedTuple):
    """Where a line is: its number from 1, its first byte, and its bytes without the newline."""

    number: int
    start: int
    size: int


class LineFile:
    """Reads a file of JSON lines, to which another process may be writing.

    Attributes:
        place: of the line that `parse` yielded last.
        torn: bytes of an unfinished last line, set by `parse`.
        damaged: numbers of lines that are not JSON, set by `parse`.
        damage: a sentence about them, or else about an unfinished last line, at the end of `parse`;
            empty without any.
    """

    def __init__(self, path: Path) -> None:
        """Note the path; nothing is read before `parse`."""
        self._path = path
        self.place = LinePlace(0, 0, 0)
        self.torn = b""
        self.damaged: list[int] = []
        self.damage = ""

    def parse(self, parse_line: Callable[[bytes, Path, int], Parsed]) -> Iterator[Parsed]:
        """Yield what `parse_line` makes of each line; nothing if there is no file.

        Damaged lines are skipped; a warning at the end names the first. An unfinished last line,
        which a process may be writing, is kept in `torn`. While a result is yielded, `place` says
        where its line is; `torn`, `damaged` and `damage` are known when the last one has been
        taken.

        Args:
            parse_line: gets the bytes of a line without its newline, the path, and the number of
                the line from 1; raises `DamagedLineError` for a line that is no JSON.

        Raises:
            StoreError: the file cannot be read, or `parse_line` raises it.
        """
        try:
            file = open_regular(self._path)
        except FileNotFoundError:
            return
        except OSError as error:
            raise StoreError(f"Cannot read {self._path}: {error.strerror}.") from error
        except InvalidValueError as error:
            raise StoreError(str(error)) from error
        with file:
            for line in self._whole_lines(file):
                try:
                    yield parse_line(line, self._path, self.place.number)
                except DamagedLineError:
                    self.damaged.append(self.place.number)
        self._describe_damage()

    def _whole_lines(self, file: BinaryIO) -> Iterator[bytes]:
        """Yield the lines of a file without newlines, and set `place` to where each is.

        A last line that is unfinished is not yielded, but kept in `torn`.

        Raises:
            StoreError: a line is too long.
        """
        start = 0
        read_line = functools.partial(file.readline, MOST_BYTES + 1)
        for number, line in enumerate(iter(read_line, b""), 1):
            if len(line) > MOST_BYTES:
                raise StoreError(
                    f"{self._path} line {number} has more than {MOST_BYTES:,} bytes; no "
                    "record is that long."
                )
            # A part of a JSON object is never valid JSON itself. So if the last line is valid, it
            # lacks only its newline, and the record is complete.
            if not line.endswith(b"\n") and not _is_json(line):
                self.torn = line
                return
            content = line.removesuffix(b"\n")
            self.place = LinePlace(number, start, len(content))
            start += len(line)
            yield content

    def _describe_damage(self) -> None:
        """Set `damage` to a sentence on damaged lines, or else on an unfinished last line.

        Damaged lines are logged as a warning; an unfinished one is not, as a run may be writing it.
        """
        if self.torn:
            self.damage = (
                f"{self._path} ends in an unfinished line (a run may be writing it); "
                "roboirg records merge copies all others."
            )
        if self.damaged:
            lines = counted(len(self.damaged), "damaged line")
            self.damage = (
                f"{self._path} has {lines}, the first is line {self.damaged[0]}; "
                "roboirg records merge copies all others."
            )
            warn_once(self.damage)

    def refuse_damage(self) -> None:
        """Raise if `parse` found a damaged or an unfinished line.

        Raises:
            StoreError: it did.
        """
        if self.damage:
            raise StoreError(self.damage)


class AppendFile:
    """A file of lines, open for appending by this process only.

    Args:
        folder: of the file; created if it does not exist. It has one writer at a time.
        name: of the file.
        torn_name: of the file that gets unfinished lines.
        read: called under the lock with the lines that are there, all of which it parses.

    Raises:
        StoreError: another process writes to the folder, it cannot be written, or `read` raises it.
        ForeignPathError: there is a symbolic link below the folder.
    """

    def __init__(
        self, folder: Path, name: str, torn_name: str, read: Callable[[LineFile], None]
    ) -> None:
        """Lock the folder, read the lines, and open the file for appending, in this order.

        If anything fails, what was opened is closed again, and the lock with it.
        """
        self.path = folder / name
        self._folder = folder
        self._torn_path = folder / torn_name
        with contextlib.ExitStack() as undo:
            try:
                folder.mkdir(parents=True, exist_ok=True)
                refuse_links(folder)
                self._lock = os.open(folder / LOCK_FILE, os.O_RDWR | os.O_CREAT, 0o644)
                undo.callback(os.close, self._lock)
                self._take_lock()
                lines = LineFile(self.path)
                read(lines)
                self._file = os.open(self.path, os.O_RDWR | os.O_CREAT | os.O_APPEND, 0o644)
                undo.callback(os.close, self._file)
                self._repair_tail(lines.torn)
                sync_to_disk(folder)
            except OSError as error:
                raise StoreError(f"Cannot write to {folder}: {error.strerror}.") from error
            undo.pop_all()

    def extend(self, lines: Iterable[bytes]) -> None:
        """Append lines to the file, given without newlines; when this returns, all are on disk.

        If one cannot be written, the file is cut to its earlier size: all lines are written or
        none. An interrupt (Ctrl-C) leaves those that are written.

        Raises:
            StoreError: they cannot be written, or `lines` raises it; the file is unchanged.
        """
        size = os.fstat(self._file).st_size
        try:
            for line in lines:
                _write_all(self._file, line + b"\n")
            os.fsync(self._file)
        except Exception as error:  # not an interrupt: what is written by then is complete
            os.ftruncate(self._file, size)
            if isinstance(error, OSError):
                raise StoreError(f"Cannot write to {self.path}: {error.strerror}.") from error
            raise

    def close(self) -> None:
        """Close the file and release the lock."""
        os.close(self._file)
        os.close(self._lock)

    def _take_lock(self) -> None:
        """Lock the folder for this process, and write its number into the lock file.

        Raises:
            StoreError: another process holds the lock; its number is in the file.
        """
        if not take_lock(self._lock, self._folder / LOCK_FILE):
            owner = os.pread(self._lock, 32, 0).decode("ascii", "replace").strip()
            if not owner.isdecimal():
                owner = "unknown"
            raise StoreError(
                f"{self._folder} is being written by another run (process {owner}); "
                f"wait for it, stop it, or choose another --out."
            )
        os.ftruncate(self._lock, 0)
        os.pwrite(self._lock, f"{os.getpid()}\n".encode(), 0)

    def _repair_tail(self, torn: bytes) -> None:
        """Make the file end in a newline, so that lines can be appended.

        An unfinished last line, of a writer that was killed, moves into a file of its own. If a
        complete line lacks only its newline, that is added.

        Args:
            torn: bytes of the unfinished line; empty if there is none.
        """
        size = os.fstat(self._file).st_size
        if torn:
            # The copy is on disk before the original is cut off, so nothing can be lost.
            aside = os.open(self._torn_path, os.O_WRONLY | os.O_CREAT | os.O_APPEND, 0o644)
            try:
                _write_all(aside, torn + b"\n")
                os.fsync(aside)
            finally:
                os.close(aside)
            os.ftruncate(self._file, size - len(torn))
        elif size:
            last_byte = os.pread(self._file, 1, size - 1)
            if last_byte != b"\n":
                # Killed between the last byte of a line and its newline: the line is complete.
                _write_all(self._file, b"\n")
        os.fsync(self._file)


@functools.cache
def warn_once(sentence: str) -> None:
    """Log a warning, unless this process has logged the same before."""
    logging.getLogger(__name__).warning("%s", sentence)


def _is_json(line: bytes) -> bool:
    """Return whether a line is valid JSON; a line of which the end is missing is not."""
    try:
        json.loads(line)
    except (ValueError, RecursionError):
        return False
    return True


def _write_all(descriptor: int, data: bytes) -> None:
    """Write bytes to a file, in one system call unless the disk is full or a signal interrupts."""
    while data:
        written = os.write(descriptor, data)
        data = data[written:]
