"""Storage of records as JSON lines, one record each, in a file that is only appended to.

Guaranteed on a local POSIX file system, besides what `line_file` guarantees:

- A damaged line in the middle is skipped, and a warning names it; all other lines are read.
- Verdicts of two policies of one name, or of two versions of one or of its server, do not get into
  one file.

Not guaranteed: anything on network file systems whose `flock` or fsync do not work as specified;
that lines are in the order of the plan (they are in the order in which episodes finished).
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from functools import cached_property
from pathlib import Path
from typing import Generic, Self, TypeVar

import msgspec

from roboirg.core.versions import Mismatch
from roboirg.evaluation.records.line_file import AppendFile, LineFile, LinePlace, warn_once
from roboirg.evaluation.records.record import Record, Summary
from roboirg.evaluation.records.record_codec import (
    RecordKey,
    StoreError,
    encode,
    identity_key,
    read_record,
    read_summary,
)

RECORDS_FILE = "records.jsonl"
TORN_FILE = "records.torn"

_BUFFER = 1 << 20
"""Bytes to read at a time."""

Stored = TypeVar("Stored", bound=Summary)


class RecordStore:
    """The records of one output folder, open for appending by this process only.

    Use as a context manager. It keeps a `Summary` of each record in memory, not the record
    itself.

    Args:
        folder: created if it does not exist.

    Attributes:
        stored: summaries by identity, the newest of each.
        torn: bytes of an unfinished line that were moved aside when the file was opened.

    Raises:
        StoreError: another process writes to the folder, or a line is not a record.
    """

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self.path = folder / RECORDS_FILE
        self.stored: dict[RecordKey, Summary] = {}
        self._told: dict[str, Summary] = {}
        self._file = AppendFile(folder, RECORDS_FILE, TORN_FILE, self._read)

    def append(self, record: Record) -> None:
        """Write one record; when this returns, it is on disk.

        Raises:
            StoreError: the record cannot be written, or the policy or its server is now another
                version than in earlier verdicts; the file is unchanged.
        """
        self.extend([encode(record)])

    def extend(self, lines: Iterable[bytes]) -> None:
        """Write records as JSON lines, without newlines; when this returns, all are on disk.

        Raises:
            StoreError: a record cannot be written, a line is not one, or a policy or its server is
                now another version than in earlier verdicts; the file is unchanged.
        """
        added: dict[RecordKey, Summary] = {}
        told = dict(self._told)

        def checked() -> Iterator[bytes]:
            for line in lines:
                read_record(line, self.path, 0)  # whole: what is stored can be read
                entry = read_summary(line, self.path, 0)
                if entry.outcome != "error":
                    before = told.get(entry.policy, entry).policy_versions
                    differences = before.differences(entry.policy_versions)
                    check_same(self.folder, entry.policy, differences, f"in {entry.slug}")
                    told[entry.policy] = entry
                added[identity_key(entry)] = entry
                yield line

        self._file.extend(checked())
        self.stored |= added
        self._told = told

    def _read(self, lines: LineFile) -> None:
        self.stored = {identity_key(one): one for one in lines.parse(read_summary)}
        self.torn = lines.torn
        self._told = _told(self.stored.values())

    def close(self) -> None:
        """Close the file and release the lock."""
        self._file.close()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_exception: object) -> None:
        self.close()


def read_records(folder: Path) -> tuple[Record, ...]:
    """Read the records of a run's folder: the newest of each identity, in the order of the file.

    An episode that ended in an error before the server reported its version has that of the others.

    Raises:
        StoreError: there are none, or a line is not a record of this schema version.
    """
    return StoredRun(folder, read_record).newest


def read_results(folder: Path) -> tuple[Summary, ...]:
    """Read the results of a run's folder: like `read_records`, but much faster and smaller.

    Raises:
        StoreError: there are none, or a line is not a record of this schema version.
    """
    return StoredRun(folder, read_summary).newest


def iterate_records(folder: Path) -> Iterator[Record]:
    """Yield the records of a run, one after the other; takes no lock, so it may be going on.

    Nothing is kept, so records that were written again come twice.

    Raises:
        StoreError: the file cannot be read, or a line is not a record of this schema version.
    """
    return LineFile(folder / RECORDS_FILE).parse(read_record)


def read_index(folder: Path) -> dict[RecordKey, Summary]:
    """Read the summaries of a run's folder, the newest of each; empty if there is no run.

    Raises:
        StoreError: the file cannot be read, or a line is not a record of this schema version.
    """
    return {identity_key(one): one for one in LineFile(folder / RECORDS_FILE).parse(read_summary)}


class StoredRun(Generic[Stored]):
    """The newest record of each identity in a run's folder, of which memory may hold a summary.

    Takes no lock, so a run may be writing to the folder; a warning names an unfinished last line.

    Args:
        folder: of the run.
        parse_line: returns what is kept of a line, given its bytes, path and number.

    Attributes:
        newest: what is kept of each record, in the order of the file.
        file: that was read, with the numbers of its damaged lines.

    Raises:
        StoreError: there are no records, or a line is not a record of this schema version.
    """

    def __init__(self, folder: Path, parse_line: Callable[[bytes, Path, int], Stored]) -> None:
        self._path = folder / RECORDS_FILE
        self.file = LineFile(self._path)
        kept: dict[RecordKey, tuple[Stored, LinePlace]] = {}
        for result in self.file.parse(parse_line):
            kept[identity_key(result)] = (result, self.file.place)
        if self.file.torn:
            warn_once(self.file.damage)
        if not kept:
            self.file.refuse_damage()
            raise StoreError(
                f"There are no records in {folder}; give the --out folder of a `roboirg run`."
            )
        self.newest: tuple[Stored, ...] = _adopt_told(one for one, _ in kept.values())
        self._in_order = [place for _, place in kept.values()]

    @cached_property
    def _places(self) -> dict[RecordKey, LinePlace]:
        """Where each record is; most readers of results never ask."""
        keys = map(identity_key, self.newest)
        return dict(zip(keys, self._in_order, strict=True))

    def lines(self, wanted: Iterable[Stored]) -> Iterator[bytes]:
        """Yield the lines of some records, without newlines."""
        with self._path.open("rb", buffering=_BUFFER) as file:
            for place in (self._places[identity_key(one)] for one in wanted):
                file.seek(place.start)
                yield file.read(place.size)

    def records(self, wanted: Iterable[Stored]) -> Iterator[Record]:
        """Yield some whole records, each read when it is asked for.

        Raises:
            StoreError: a line is not a record.
        """
        wanted = list(wanted)
        for one, line in zip(wanted, self.lines(wanted), strict=True):
            yield read_record(line, self._path, self._places[identity_key(one)].number)


def _told(records: Iterable[Summary]) -> dict[str, Summary]:
    """Return a result of each policy, of those with a verdict: the server reported its version."""
    return {record.policy: record for record in records if record.outcome != "error"}


def check_same(folder: Path, policy: str, found: Iterable[Mismatch], where: str = "now") -> None:
    """Refuse another policy of a name of which a folder holds episodes, or another version of it.

    Args:
        folder: for the message, as `policy`.
        policy: its name.
        found: the differences, the folder's values first.
        where: the second values are found.

    Raises:
        StoreError: there is a difference; the message has the first.
    """
    for what, first, second in found:
        raise StoreError(
            f"{folder} holds episodes of {policy} whose {what} is {first}, but {where} it is "
            f"{second}; choose another --out."
        )


def _adopt_told(records: Iterable[Stored]) -> tuple[Stored, ...]:
    """Return the records; errors without a server's version get that of the policy's verdicts."""
    found = list(records)
    told = _told(found)
    for position, record in enumerate(found):
        if record.outcome == "error" and record.server_version is None and record.policy in told:
            version = told[record.policy].server_version
            found[position] = msgspec.structs.replace(record, server_version=version)
    return tuple(found)
