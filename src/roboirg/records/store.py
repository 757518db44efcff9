"""The file of records: append-only JSON lines that survive being killed.

Guaranteed, on a local POSIX file system:

- A record that `append` returned from is on the disk (one write, then fsync), whole, on one line.
- Killing the process at any moment loses at most the record whose `append` had not returned. A
  torn last line is never read as a record; the next writer moves it to ``records.torn`` (copied
  and synced there before it is cut off here) and says so.
- A line in the middle that is no JSON costs that line alone: it is passed over and told of.
- One writer at a time: the lock is the kernel's (`flock`), so it ends with its owner, however
  that dies, and never goes stale.

Not guaranteed: anything on network file systems whose `flock` or fsync do not do what they say;
that lines are in the order of the plan (they are in the order in which episodes ended).
"""

from __future__ import annotations

import contextlib
import fcntl
import json
import os
from collections.abc import Callable, Iterator
from functools import partial
from pathlib import Path
from typing import NamedTuple, Self, TypeVar

from roboirg.records.record import Record, Result
from roboirg.records.record_codec import (
    DamagedLineError,
    RecordIndexEntry,
    RecordKey,
    StoreError,
    identity_key,
    read_index_entry,
    read_line,
)

__all__ = [
    "RecordStore",
    "StoreContents",
    "StoreError",
    "read_contents",
    "read_records",
    "read_results",
]

RECORDS_FILE = "records.jsonl"
TORN_FILE = "records.torn"
LOCK_FILE = ".lock"

_BUFFER = 1 << 20
"""Bytes that are read at once."""

ResultType = TypeVar("ResultType", bound=Result)
Parsed = TypeVar("Parsed")


class StoreContents(NamedTuple):
    """What a file of records holds.

    Attributes:
        records: all of them, in the order of the file.
        torn: bytes of an unfinished last line, usually empty.
        damaged: numbers of the lines that are no JSON, usually none.
    """

    records: tuple[Record, ...]
    torn: bytes
    damaged: tuple[int, ...] = ()


class RecordStore:
    """The records of one output folder, open for appending by this process alone.

    Use as a context manager. It keeps a `RecordIndexEntry` of each record
    in memory, not the record itself.

    Args:
        folder: made if it does not exist.

    Attributes:
        stored: what is in the file, the newest of each identity.
        torn: the bytes that were moved aside when it was opened.
        damaged: numbers of the lines that are no JSON; their episodes count as not played.

    Raises:
        StoreError: another process writes there, or the file is not one of ours.
    """

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self.path = folder / RECORDS_FILE
        with contextlib.ExitStack() as undo:
            try:
                folder.mkdir(parents=True, exist_ok=True)
                self._lock = os.open(folder / LOCK_FILE, os.O_RDWR | os.O_CREAT, 0o644)
                undo.callback(os.close, self._lock)
                self._take_lock()
                lines = _RecordsFile(self.path)
                self.stored: dict[RecordKey, RecordIndexEntry] = {
                    identity_key(one): one for one in lines.parsed(read_index_entry)
                }
                self.torn, self.damaged = lines.torn, tuple(lines.damaged)
                self._file = os.open(self.path, os.O_RDWR | os.O_CREAT | os.O_APPEND, 0o644)
                undo.callback(os.close, self._file)
                self._repair_tail()
                _sync_folder(folder)
            except OSError as error:
                raise StoreError(f"Cannot write to {folder}: {error.strerror}.") from error
            undo.pop_all()

    def append(self, record: Record) -> None:
        """Write one record; when this returns, it is on the disk.

        Raises:
            StoreError: it cannot be written; the file is as it was before.
        """
        size = os.fstat(self._file).st_size
        try:
            line = record.model_dump_json().encode()
            _write_all(self._file, line + b"\n")
            os.fsync(self._file)
        except OSError as error:
            os.ftruncate(self._file, size)
            raise StoreError(f"Cannot write to {self.path}: {error.strerror}.") from error
        self.stored[identity_key(record)] = read_index_entry(line, self.path, 0)

    def close(self) -> None:
        """Let the next writer in."""
        os.close(self._file)
        os.close(self._lock)

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_exception: object) -> None:
        self.close()

    def _take_lock(self) -> None:
        try:
            fcntl.flock(self._lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            owner = os.pread(self._lock, 32, 0).decode().strip() or "unknown"
            raise StoreError(
                f"{self.folder} is being written by another run (process {owner}); "
                f"wait for it, stop it, or choose another --out."
            ) from None
        os.ftruncate(self._lock, 0)
        os.pwrite(self._lock, f"{os.getpid()}\n".encode(), 0)

    def _repair_tail(self) -> None:
        """Leave the file empty or ending in a newline, losing nothing."""
        size = os.fstat(self._file).st_size
        if self.torn:
            aside = os.open(self.folder / TORN_FILE, os.O_WRONLY | os.O_CREAT | os.O_APPEND, 0o644)
            try:
                _write_all(aside, self.torn + b"\n")
                os.fsync(aside)
            finally:
                os.close(aside)
            os.ftruncate(self._file, size - len(self.torn))
        elif size and os.pread(self._file, 1, size - 1) != b"\n":
            # Killed between the last byte of a record and its newline: the record is whole.
            _write_all(self._file, b"\n")
        os.fsync(self._file)


def read_contents(path: Path) -> StoreContents:
    """Everything in a file of records; takes no lock, so a run may be under way.

    Raises:
        StoreError: a line is a record of a version that cannot be read, or no record.
    """
    lines = _RecordsFile(path)
    records = tuple(lines.parsed(partial(read_line, kind=Record)))
    return StoreContents(records, lines.torn, tuple(lines.damaged))


def read_records(folder: Path) -> tuple[Record, ...]:
    """The records of a run's folder, the newest of each identity, in the order of the file.

    Raises:
        StoreError: there are none, or a line is no record of a version that can be read.
    """
    return _read_newest(folder, Record)


def read_results(folder: Path) -> tuple[Result, ...]:
    """As `read_records`, without what was said and done: for very many of them.

    Raises:
        StoreError: there are none, or a line is no record of a version that can be read.
    """
    return _read_newest(folder, Result)


def read_index(folder: Path) -> dict[RecordKey, RecordIndexEntry]:
    """What is stored in a run's folder, the newest of each identity; empty if there is no run.

    Raises:
        StoreError: the file cannot be read, or a line is no record of a version that can be read.
    """
    return {
        identity_key(one): one
        for one in _RecordsFile(folder / RECORDS_FILE).parsed(read_index_entry)
    }


def write_atomically(path: Path, text: str) -> None:
    """Replace a file whole: readers see the old or the new text, never a part.

    Raises:
        StoreError: the folder cannot be written to.
    """
    partial = path.with_name(f".{path.name}.part")
    try:
        with partial.open("w", encoding="utf-8") as file:
            file.write(text)
            file.flush()
            os.fsync(file.fileno())
        partial.replace(path)
        _sync_folder(path.parent)
    except OSError as error:
        raise StoreError(f"Cannot write {path}: {error.strerror}.") from error


class _RecordsFile:
    """A file of records, line by line.

    Attributes:
        torn: bytes of an unfinished last line, known after `parsed`.
        damaged: numbers of lines that are no JSON, known after `parsed`.
    """

    def __init__(self, path: Path) -> None:
        self._path = path
        self.torn = b""
        self.damaged: list[int] = []

    def parsed(self, parse: Callable[[bytes, Path, int], Parsed]) -> Iterator[Parsed]:
        """What `parse` makes of each line, path and number; nothing if there is no file.

        Raises:
            StoreError: the file cannot be read, or whatever `parse` raises.
        """
        try:
            file = self._path.open("rb", buffering=_BUFFER)
        except FileNotFoundError:
            return
        except OSError as error:
            raise StoreError(f"Cannot read {self._path}: {error.strerror}.") from error
        with file:
            for number, line in enumerate(file, start=1):
                # A JSON object has no proper prefix that is one: if the last line lacks nothing
                # but its newline, the record is whole.
                if not line.endswith(b"\n") and not _is_json(line):
                    self.torn = line
                    return
                try:
                    yield parse(line.removesuffix(b"\n"), self._path, number)
                except DamagedLineError:
                    self.damaged.append(number)


def _is_json(line: bytes) -> bool:
    try:
        json.loads(line)
    except ValueError:
        return False
    return True


def _read_newest(folder: Path, kind: type[ResultType]) -> tuple[ResultType, ...]:
    lines = _RecordsFile(folder / RECORDS_FILE)
    newest: dict[RecordKey, ResultType] = {}
    for one in lines.parsed(partial(read_line, kind=kind)):
        newest[identity_key(one)] = one
    if not newest:
        raise StoreError(
            f"There are no records in {folder}; give the --out folder of a `roboirg run`."
        )
    return tuple(newest.values())


def _write_all(descriptor: int, data: bytes) -> None:
    # One system call unless the disk is full or a signal comes in between.
    while data:
        data = data[os.write(descriptor, data) :]


def _sync_folder(folder: Path) -> None:
    descriptor = os.open(folder, os.O_RDONLY)
    try:
        os.fsync(descriptor)
    finally:
        os.close(descriptor)
