"""The file of records: append-only JSON lines that survive being killed.

Guaranteed, on a local POSIX file system:

- A record that `append` returned from is on the disk (one write, then fsync), whole, on one line.
- Killing the process at any moment loses at most the record whose `append` had not returned. A
  torn last line is never read as a record; the next writer moves it to ``records.torn`` (copied
  and synced there before it is cut off here) and says so.
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
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import NamedTuple, Self

from pydantic import ValidationError

from roboirg.errors import RoboIRGError
from roboirg.evaluation.record import SCHEMA_VERSION, Job, Record

RECORDS_FILE = "records.jsonl"
TORN_FILE = "records.torn"
LOCK_FILE = ".lock"


class StoreError(RoboIRGError):
    """The records cannot be read or written; the sentence says which and why."""


class Contents(NamedTuple):
    """What a file of records holds.

    Attributes:
        records: all of them, in the order of the file.
        torn: bytes of an unfinished last line, usually empty.
    """

    records: tuple[Record, ...]
    torn: bytes


class RecordStore:
    """The records of one output folder, open for appending by this process alone.

    Use as a context manager. `torn` holds the bytes that were moved aside when it was opened.

    Args:
        folder: made if it does not exist.

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
                contents = read_contents(self.path)
                self.torn = contents.torn
                self._records = list(contents.records)
                self._file = os.open(self.path, os.O_RDWR | os.O_CREAT | os.O_APPEND, 0o644)
                undo.callback(os.close, self._file)
                self._mend()
                _sync_folder(folder)
            except OSError as error:
                raise StoreError(f"Cannot write to {folder}: {error.strerror}.") from error
            undo.pop_all()

    @property
    def records(self) -> tuple[Record, ...]:
        """All records, in the order of the file."""
        return tuple(self._records)

    def append(self, record: Record) -> None:
        """Write one record; when this returns, it is on the disk.

        Raises:
            StoreError: it cannot be written; the file is as it was before.
        """
        size = os.fstat(self._file).st_size
        try:
            _write_all(self._file, record.model_dump_json().encode() + b"\n")
            os.fsync(self._file)
        except OSError as error:
            os.ftruncate(self._file, size)
            raise StoreError(f"Cannot write to {self.path}: {error.strerror}.") from error
        self._records.append(record)

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

    def _mend(self) -> None:
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


def read_contents(path: Path) -> Contents:
    """Everything in a file of records; takes no lock, so a run may be under way.

    Raises:
        StoreError: a line is not a record of this version.
    """
    try:
        *lines, last = path.read_bytes().split(b"\n")
    except FileNotFoundError:
        return Contents((), b"")
    except OSError as error:
        raise StoreError(f"Cannot read {path}: {error.strerror}.") from error
    records = [_parse(line, path, number) for number, line in enumerate(lines, start=1)]
    if not last:
        return Contents(tuple(records), b"")
    try:
        json.loads(last)
    except ValueError:
        return Contents(tuple(records), last)
    # A JSON object has no proper prefix that is one: this line lacks nothing but its newline.
    return Contents((*records, _parse(last, path, len(lines) + 1)), b"")


def read_records(folder: Path) -> tuple[Record, ...]:
    """The records of a run's folder, the newest of each identity, in the order of the file.

    Raises:
        StoreError: there are none, or a line is not a record of this version.
    """
    path = folder / RECORDS_FILE
    records = latest(read_contents(path).records)
    if not records:
        raise StoreError(
            f"There are no records in {folder}; give the --out folder of a `roboirg run`."
        )
    return tuple(records.values())


def latest(records: Iterable[Record]) -> Mapping[Job, Record]:
    """The newest record of each job."""
    newest: dict[Job, Record] = {}
    for record in records:
        newest[record.identity] = record
    return newest


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


def _parse(line: bytes, path: Path, number: int) -> Record:
    where = f"{path} line {number}"
    try:
        data = json.loads(line)
    except ValueError as error:
        raise StoreError(f"{where} is damaged: it is not JSON ({error}).") from error
    version = data.get("schema_version") if isinstance(data, dict) else None
    if version != SCHEMA_VERSION:
        raise StoreError(
            f"{where} has schema version {version!r}, but this roboirg reads version "
            f"{SCHEMA_VERSION}; use the roboirg that wrote it, or another folder."
        )
    try:
        return Record.model_validate_json(line)
    except ValidationError as error:
        first = error.errors()[0]
        place = ".".join(str(part) for part in first["loc"])
        raise StoreError(f"{where} is not a record: {place}: {first['msg']}.") from error


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
