"""Storage of records as JSON lines, one record each, in a file that is only appended to.

Guaranteed on a local POSIX file system, besides what `line_file` guarantees:

- A damaged line in the middle is skipped, and a warning names it; all other lines are read.
- Verdicts of two policies of one name, or of two versions of one or of its server, do not get into
  one file.

Not guaranteed: anything on network file systems whose `flock` or fsync do not work as specified;
that lines are in the order of the plan (they are in the order in which episodes finished).
"""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Collection, Iterable, Iterator
from functools import cached_property
from pathlib import Path
from typing import Generic, Self, TypeVar

import msgspec

from roboirg.core.policy_ref import UNKNOWN_VERSION
from roboirg.core.versions import Mismatch
from roboirg.records.line_file import AppendFile, LineFile, LinePlace, warn_once
from roboirg.records.record import Record, Summary
from roboirg.records.record_codec import (
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
        """Open the folder's file for appending, and read what it holds."""
        self.folder = folder
        self.path = folder / RECORDS_FILE
        self.stored: dict[RecordKey, Summary] = {}
        self._verdicts: dict[str, Summary] = {}  # the last one of each policy
        self._file = AppendFile(folder, RECORDS_FILE, TORN_FILE, self._read)

    def append(self, record: Record) -> None:
        """Write one record; when this returns, it is on disk.

        Raises:
            StoreError: the record cannot be written, or the policy or its server is now another
                version than in earlier verdicts; the file is unchanged.
        """
        self.extend([encode(record)])

    def extend(self, lines: Iterable[bytes]) -> None:
        """Append records, each a line of JSON without its newline; all are stored or none.

        When this returns, they are on disk. Until then `stored` does not change.

        Raises:
            StoreError: a record cannot be written, a line is not one, or a policy or its server is
                now another version than in earlier verdicts; the file is unchanged.
        """
        added = {}
        verdicts = dict(self._verdicts)

        def checked_lines() -> Iterator[bytes]:
            """Yield each line that is a record, of the same versions as the policy's last verdict.

            An error is not compared, as it may come before the versions are known.
            """
            for line in lines:
                read_record(line, self.path, 0)  # raises if it could not be read later
                result = read_summary(line, self.path, 0)
                if result.outcome != "error":
                    earlier = verdicts.get(result.policy, result)
                    found = earlier.policy_versions.differences(result.policy_versions)
                    what = f"{self.folder} holds episodes of {result.policy}"
                    check_same(what, found, f"in {result.slug}")
                    verdicts[result.policy] = result
                added[identity_key(result)] = result
                yield line

        self._file.extend(checked_lines())
        self.stored |= added
        self._verdicts = verdicts

    def _read(self, lines: LineFile) -> None:
        """Read the summaries of the records that are in the file."""
        self.stored = {identity_key(result): result for result in lines.parse(read_summary)}
        self.torn = lines.torn
        self._verdicts = _last_verdicts(self.stored.values())

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
    results = LineFile(folder / RECORDS_FILE).parse(read_summary)
    return {identity_key(result): result for result in results}


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
        """Read all lines; of each identity keep what the newest one gave, and where that is.

        An episode that ended in an error and was played again has two lines. `newest` has what the
        second gave, at the place of the first: lines A, B, A' → A', B.

        `_places_in_order` has the same order and length as `newest`; `_places` relies on that.
        """
        self._path = folder / RECORDS_FILE
        self.file = LineFile(self._path)
        placed: dict[RecordKey, tuple[Stored, LinePlace]] = {}
        for result in self.file.parse(parse_line):
            placed[identity_key(result)] = (result, self.file.place)
        if self.file.torn:
            warn_once(self.file.damage)
        if not placed:
            self.file.refuse_damage()
            raise StoreError(
                f"There are no records in {folder}; give the --out folder of a `roboirg run`."
            )
        results, self._places_in_order = zip(*placed.values(), strict=True)
        self.newest: tuple[Stored, ...] = _with_versions(results)

    @cached_property
    def _places(self) -> dict[RecordKey, LinePlace]:
        """Where each record is; most readers never ask, and keys would fill their memory."""
        keys = map(identity_key, self.newest)
        return dict(zip(keys, self._places_in_order, strict=True))

    def lines(self, wanted: Iterable[Stored]) -> Iterator[bytes]:
        """Yield the lines of some records from the file, as bytes without newlines.

        They come in the order of `wanted`, all of which must be among `newest`. Their places in the
        file stay true, as it is only appended to.
        """
        with self._path.open("rb", buffering=_BUFFER) as file:
            for result in wanted:
                place = self._places[identity_key(result)]
                file.seek(place.start)
                yield file.read(place.size)

    def records(self, wanted: Iterable[Stored]) -> Iterator[Record]:
        """Yield some whole records, each read when it is asked for.

        Raises:
            StoreError: a line is not a record.
        """
        results = list(wanted)
        for result, line in zip(results, self.lines(results), strict=True):
            place = self._places[identity_key(result)]
            yield read_record(line, self._path, place.number)


def _last_verdicts(results: Iterable[Stored]) -> dict[str, Stored]:
    """Return the last success or failure of each policy, by its name.

    In contrast to an error, such a result has the version of the policy's server.
    """
    return {result.policy: result for result in results if result.outcome != "error"}


def check_same(
    what: str, found: Iterable[Mismatch], where: str = "now", end: str = "choose another --out"
) -> None:
    """Raise if there is a difference between the versions of two records.

    For example ``runs/a holds episodes of mine whose policy version is 1, but now it is 2; choose
    another --out.``

    Args:
        what: has the first values; the message begins with it.
        found: the differences; without any, nothing is raised.
        where: the second values are found.
        end: of the message.

    Raises:
        StoreError: there is a difference; the message has the first.
    """
    for name, first, second in found:
        raise StoreError(f"{what} whose {name} is {first}, but {where} it is {second}; {end}.")


def _with_versions(results: Collection[Stored]) -> tuple[Stored, ...]:
    """Return the results, with the versions of policy and server filled in where errors lack them.

    An error may come before a policy declares its version, or its server reports one; then it gets
    that of the policy's last success or failure, if there is one, and so stays in its row.
    """
    verdicts = _last_verdicts(results)
    completed = []
    for result in results:
        verdict = verdicts.get(result.policy)
        if result.outcome == "error" and verdict is not None:
            completed.append(_completed(result, verdict))
        else:
            completed.append(result)
    return tuple(completed)


def _completed(error: Stored, verdict: Stored) -> Stored:
    """Return an error with what it lacks of the versions that a verdict of the same policy has."""
    ref = error.ref
    if ref.version == UNKNOWN_VERSION and ref.makeup == verdict.ref.makeup:
        ref = dataclasses.replace(ref, version=verdict.ref.version)
    server_version = error.server_version or verdict.server_version
    return msgspec.structs.replace(error, ref=ref, server_version=server_version)
