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
from collections.abc import Callable, Iterable, Iterator
from pathlib import Path
from typing import Generic, NamedTuple, Self, TypeVar

from roboirg.records.record import Job, Record
from roboirg.records.record_codec import (
    DamagedLineError,
    EpisodeSummary,
    RecordIndexEntry,
    RecordKey,
    StoredInstruction,
    StoreError,
    identity_key,
    read_index_entry,
    read_instruction,
    read_line,
    read_summary,
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
    "StoredRun",
    "read_contents",
    "read_records",
    "read_results",
]

RECORDS_FILE = "records.jsonl"
TORN_FILE = "records.torn"
LOCK_FILE = ".lock"

_BUFFER = 1 << 20
"""Bytes to read at a time."""

Parsed = TypeVar("Parsed")
Identified = TypeVar("Identified", bound=Job | RecordIndexEntry)


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
        self.extend([record.model_dump_json().encode()])

    def extend(self, lines: Iterable[bytes]) -> None:
        """Write records as JSON lines, without newlines; when this returns, all are on disk.

        Raises:
            StoreError: a record cannot be written, a line is not one, or a policy's server is now
                another version than in earlier verdicts; the file is unchanged.
        """
        size = os.fstat(self._file).st_size
        added: dict[RecordKey, RecordIndexEntry] = {}
        told = dict(self._told)
        try:
            for line in lines:
                entry = read_index_entry(line, self.path, 0)
                check_told_version(self.folder, told, entry)
                told |= told_versions([entry])
                _write_all(self._file, line + b"\n")
                added[identity_key(entry)] = entry
            os.fsync(self._file)
        except Exception as error:  # not an interrupt: what is written by then is complete
            os.ftruncate(self._file, size)
            if isinstance(error, OSError):
                raise StoreError(f"Cannot write to {self.path}: {error.strerror}.") from error
            raise
        self.stored |= added
        self._told = told

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
    records = tuple(lines.parse(read_line))
    return StoreContents(records, lines.torn, tuple(lines.damaged))


def read_records(folder: Path) -> tuple[Record, ...]:
    """Read the records of a run's folder: the newest of each identity, in the order of the file.

    An episode that ended in an error before the server told its version has that of the others.

    Raises:
        StoreError: there are none, or a line is not a record of this schema version.
    """
    return StoredRun(folder, read_line).newest


def read_results(folder: Path) -> tuple[EpisodeSummary, ...]:
    """Read the results of a run's folder: like `read_records`, but much faster and smaller.

    Raises:
        StoreError: there are none, or a line is not a record of this schema version.
    """
    return read_summaries(folder).newest


def read_summaries(folder: Path) -> StoredRun[EpisodeSummary]:
    """Read the summaries of a run's folder; its records are read again one by one.

    Raises:
        StoreError: there are none, or a line is not a record of this schema version.
    """
    return StoredRun(folder, read_summary)


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


class LinePlace(NamedTuple):
    """Where a line is: its number from 1, its first byte, and its bytes without the newline."""

    number: int
    start: int
    size: int


class StoredRun(Generic[Identified]):
    """The newest record of each identity in a run's folder, of which only a part is in memory.

    Takes no lock, so a run may be writing to the folder.

    Args:
        folder: of the run.
        parse_line: returns what is kept of a line, given its bytes, path and number.

    Attributes:
        newest: what is kept of each record, in the order of the file.
        replaced: of earlier records of the same episodes.

    Raises:
        StoreError: there are no records, or a line is not a record of this schema version.
    """

    def __init__(self, folder: Path, parse_line: Callable[[bytes, Path, int], Identified]) -> None:
        self._path = folder / RECORDS_FILE
        lines = _RecordsFile(self._path)
        kept: dict[RecordKey, tuple[Identified, LinePlace]] = {}
        self.replaced: list[Identified] = []
        for one in lines.parse(parse_line):
            key = identity_key(one)
            if key in kept:
                self.replaced.append(kept[key][0])
            kept[key] = (one, lines.place)
        if not kept:
            raise StoreError(
                f"There are no records in {folder}; give the --out folder of a `roboirg run`."
            )
        self.newest: tuple[Identified, ...] = adopt_told_versions(one for one, _ in kept.values())
        self._places = {key: place for key, (_, place) in kept.items()}

    def lines(self, wanted: Iterable[Identified]) -> Iterator[bytes]:
        """Yield the lines of some records, without newlines."""
        with self._path.open("rb", buffering=_BUFFER) as file:
            for place in (self._places[identity_key(one)] for one in wanted):
                file.seek(place.start)
                yield file.read(place.size)

    def records(self, wanted: Iterable[Identified]) -> Iterator[Record]:
        """Yield some whole records, each read when it is asked for.

        Raises:
            StoreError: a line is not a record.
        """
        return self._parsed(wanted, read_line)

    def instructions(self) -> Iterator[StoredInstruction]:
        """Yield what tells the instructions of all records apart, each read when it is asked for.

        Raises:
            StoreError: a line is not a record.
        """
        return self._parsed(self.newest, read_instruction)

    def _parsed(
        self, wanted: Iterable[Identified], parse_line: Callable[[bytes, Path, int], Parsed]
    ) -> Iterator[Parsed]:
        wanted = list(wanted)
        for one, line in zip(wanted, self.lines(wanted), strict=True):
            yield parse_line(line, self._path, self._places[identity_key(one)].number)


class _RecordsFile:
    """Reads a records file line by line.

    Attributes:
        place: of the line that `parse` yielded last.
        torn: bytes of an unfinished last line, set by `parse`.
        damaged: numbers of lines that are not JSON, set by `parse`.
    """

    def __init__(self, path: Path) -> None:
        self._path = path
        self.place = LinePlace(0, 0, 0)
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
            start = 0
            for number, line in enumerate(file, start=1):
                # No proper prefix of a JSON object is valid JSON: if the last line lacks only its
                # newline, the record is complete.
                if not line.endswith(b"\n") and not _is_json(line):
                    self.torn = line
                    return
                content = line.removesuffix(b"\n")
                self.place = LinePlace(number, start, len(content))
                start += len(line)
                try:
                    yield parse_line(content, self._path, number)
                except DamagedLineError:
                    self.damaged.append(number)


def _is_json(line: bytes) -> bool:
    try:
        json.loads(line)
    except ValueError:
        return False
    return True


def _write_all(descriptor: int, data: bytes) -> None:
    # One system call, unless the disk is full or a signal interrupts it.
    while data:
        data = data[os.write(descriptor, data) :]
