"""Crash-safe storage of records as append-only JSON lines.

Guaranteed on a local POSIX file system:

- When `append` returns, the record is on disk (one write, then fsync), complete, on one line.
- Killing the process at any moment loses at most the record whose `append` has not returned. A
  torn last line is never read as a record; the next writer moves it to ``records.torn`` (copied
  and synced there before it is removed here) and reports it.
- A damaged line in the middle is skipped and reported; all other lines are read.
- Verdicts of two versions of a policy's server do not get into one file.
- There is one writer at a time: the lock is the kernel's (`flock`), so it is released when its
  owner dies and never goes stale.

Not guaranteed: anything on network file systems whose `flock` or fsync do not work as specified;
that lines are in the order of the plan (they are in the order in which episodes finished).
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
    StoredInstruction,
    StoreError,
    identity_key,
    read_index_entry,
    read_instruction,
    read_line,
)
from roboirg.records.server_versions import (
    adopt_told_versions,
    check_told_version,
    told_versions,
)
from roboirg.util.atomic_write import sync_to_disk

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
"""Bytes to read at a time."""

ResultType = TypeVar("ResultType", bound=Result)
Parsed = TypeVar("Parsed")


class StoreContents(NamedTuple):
    """Contents of a records file.

    Attributes:
        records: all records, in the order of the file.
        torn: bytes of an unfinished last line, usually empty.
        damaged: numbers of the lines that are not JSON, usually none.
    """

    records: tuple[Record, ...]
    torn: bytes
    damaged: tuple[int, ...] = ()


class RecordStore:
    """The records of one output folder, open for appending by this process only.

    Use as a context manager. It keeps a `RecordIndexEntry` of each record in memory, not the record
    itself.

    Args:
        folder: created if it does not exist.

    Attributes:
        stored: index entries by identity, the newest of each.
        torn: bytes of an unfinished line that were moved aside when the file was opened.
        damaged: numbers of the lines that are not JSON; their episodes count as not played.

    Raises:
        StoreError: another process writes to the folder, or a line is not a record.
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
                    identity_key(one): one for one in lines.parse(read_index_entry)
                }
                self.torn, self.damaged = lines.torn, tuple(lines.damaged)
                self._told = told_versions(self.stored.values())
                self._file = os.open(self.path, os.O_RDWR | os.O_CREAT | os.O_APPEND, 0o644)
                undo.callback(os.close, self._file)
                self._repair_tail()
                sync_to_disk(folder)
            except OSError as error:
                raise StoreError(f"Cannot write to {folder}: {error.strerror}.") from error
            undo.pop_all()

    def append(self, record: Record) -> None:
        """Write one record; when this returns, it is on disk.

        Raises:
            StoreError: the record cannot be written, or the policy's server is now another version
                than in earlier verdicts; the file is unchanged.
        """
        check_told_version(self.folder, self._told, record)
        size = os.fstat(self._file).st_size
        try:
            line = record.model_dump_json().encode()
            _write_all(self._file, line + b"\n")
            os.fsync(self._file)
        except OSError as error:
            os.ftruncate(self._file, size)
            raise StoreError(f"Cannot write to {self.path}: {error.strerror}.") from error
        self.stored[identity_key(record)] = read_index_entry(line, self.path, 0)
        self._told |= told_versions([record])

    def close(self) -> None:
        """Close the file and release the lock."""
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
        """Move a torn line aside, so that the file is empty or ends in a newline."""
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
            # Killed between the last byte of a record and its newline: the record is complete.
            _write_all(self._file, b"\n")
        os.fsync(self._file)


def read_contents(path: Path) -> StoreContents:
    """Read a whole records file; takes no lock, so a run may be writing to it.

    Raises:
        StoreError: a line is not a record of this schema version.
    """
    lines = _RecordsFile(path)
    records = tuple(lines.parse(partial(read_line, kind=Record)))
    return StoreContents(records, lines.torn, tuple(lines.damaged))


def read_records(folder: Path) -> tuple[Record, ...]:
    """Read the records of a run's folder: the newest of each identity, in the order of the file.

    An episode that ended in an error before the server told its version has that of the others.

    Raises:
        StoreError: there are none, or a line is not a record of this schema version.
    """
    return _read_newest(folder, Record)


def read_results(folder: Path) -> tuple[Result, ...]:
    """Read the results of a run's folder: like `read_records`, but faster and smaller.

    Raises:
        StoreError: there are none, or a line is not a record of this schema version.
    """
    return _read_newest(folder, Result)


def read_instructions(folder: Path) -> Iterator[StoredInstruction]:
    """Yield what tells the instructions of a run apart, one record after the other.

    Nothing is kept, so records that were written again come twice.

    Raises:
        StoreError: the file cannot be read, or a line is not a record of this schema version.
    """
    return _RecordsFile(folder / RECORDS_FILE).parse(read_instruction)


def read_index(folder: Path) -> dict[RecordKey, RecordIndexEntry]:
    """Read the index entries of a run's folder, the newest of each; empty if there is no run.

    Raises:
        StoreError: the file cannot be read, or a line is not a record of this schema version.
    """
    return {
        identity_key(one): one
        for one in _RecordsFile(folder / RECORDS_FILE).parse(read_index_entry)
    }


class _RecordsFile:
    """Reads a records file line by line.

    Attributes:
        torn: bytes of an unfinished last line, set by `parse`.
        damaged: numbers of lines that are not JSON, set by `parse`.
    """

    def __init__(self, path: Path) -> None:
        self._path = path
        self.torn = b""
        self.damaged: list[int] = []

    def parse(self, parse_line: Callable[[bytes, Path, int], Parsed]) -> Iterator[Parsed]:
        """Yield `parse_line` of each line, path and line number; nothing if there is no file.

        Raises:
            StoreError: the file cannot be read, or `parse_line` raises it.
        """
        try:
            file = self._path.open("rb", buffering=_BUFFER)
        except FileNotFoundError:
            return
        except OSError as error:
            raise StoreError(f"Cannot read {self._path}: {error.strerror}.") from error
        with file:
            for number, line in enumerate(file, start=1):
                # No proper prefix of a JSON object is valid JSON: if the last line lacks only its
                # newline, the record is complete.
                if not line.endswith(b"\n") and not _is_json(line):
                    self.torn = line
                    return
                try:
                    yield parse_line(line.removesuffix(b"\n"), self._path, number)
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
    for one in lines.parse(partial(read_line, kind=kind)):
        newest[identity_key(one)] = one
    if not newest:
        raise StoreError(
            f"There are no records in {folder}; give the --out folder of a `roboirg run`."
        )
    return adopt_told_versions(newest.values())


def _write_all(descriptor: int, data: bytes) -> None:
    # One system call, unless the disk is full or a signal interrupts it.
    while data:
        data = data[os.write(descriptor, data) :]
