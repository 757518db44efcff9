"""Merge several runs into one folder."""

from __future__ import annotations

import contextlib
import os
import shutil
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import NamedTuple

from roboirg.core.errors import InvalidValueError
from roboirg.records.record import Record
from roboirg.records.record_codec import RecordKey, StoreError, identity_key
from roboirg.records.store import RecordStore, read_records


class MergeSummary(NamedTuple):
    """Result of a merge.

    Attributes:
        added: number of records added to the folder.
        duplicates: number of records whose episode was already there.
        conflicts: duplicates with another verdict than the one kept.
    """

    added: int
    duplicates: int
    conflicts: tuple[Record, ...]


def merge_runs(folders: Sequence[Path], out: Path) -> MergeSummary:
    """Copy the records and videos of several runs into one folder.

    If several runs have the same episode, the first verdict is kept; a verdict replaces an error.

    Args:
        folders: output folders of the runs; they are not changed.
        out: destination; may already hold records.

    Raises:
        InvalidValueError: `out` is one of the runs.
        StoreError: a file cannot be read or written, or versions differ.
    """
    if out.resolve() in {folder.resolve() for folder in folders}:
        raise InvalidValueError(f"{out} is one of the runs to be merged; choose another --out.")
    runs = [(folder, read_records(folder)) for folder in folders]
    _check_versions(runs)
    added, duplicates, conflicts = 0, 0, []
    with RecordStore(out) as store:
        kept: dict[RecordKey, Record] = {}
        if store.stored:
            stored = read_records(out)
            _check_versions([(out, stored), *runs])
            kept = {identity_key(record): record for record in stored}
        for folder, records in runs:
            for record in records:
                before = kept.get(identity_key(record))
                if before is not None:
                    duplicates += 1
                    if before.outcome != "error":
                        if record.outcome not in ("error", before.outcome):
                            conflicts.append(record)
                        continue
                    if record.outcome == "error":
                        continue
                store.append(_copy_video(record, folder, out))
                kept[identity_key(record)] = record
                added += before is None
    return MergeSummary(added, duplicates, tuple(conflicts))


def _check_versions(runs: Sequence[tuple[Path, Sequence[Record]]]) -> None:
    """Refuse records of different versions, as a run does."""
    first: dict[object, tuple[Path, object]] = {}
    for folder, records in runs:
        for record in records:
            for what, value in (
                (("language version",), record.language_version),
                (("environment version",), record.environment_version),
                (("version", "of policy", record.policy), record.policy_version),
                *_server_version(record),
                (("seed", "of", record.task, record.split, record.episode), record.seed),
            ):
                there, expected = first.setdefault(what, (folder, value))
                if value != expected:
                    raise StoreError(
                        f"{folder} and {there} cannot be merged: the "
                        f"{' '.join(map(str, what))} is {value!r} in the first and "
                        f"{expected!r} in the second."
                    )


def _server_version(record: Record) -> Iterator[tuple[tuple[object, ...], object]]:
    """Yield the version of the policy's server, if the episode has a verdict."""
    if record.outcome != "error":
        yield ("version", "of the server of", record.policy), record.server_version


def _copy_video(record: Record, source: Path, target: Path) -> Record:
    """Copy the record's video and return the record, without a video if the file is missing."""
    if record.video is None:
        return record
    video, copy = source / record.video, target / record.video
    if not video.is_file():
        return record.model_copy(update={"video": None})
    if copy.exists():
        return record
    copy.parent.mkdir(parents=True, exist_ok=True)
    _copy_file(video, copy)
    with contextlib.suppress(FileNotFoundError):
        _copy_file(video.with_suffix(".jpg"), copy.with_suffix(".jpg"))
    return record


def _copy_file(path: Path, copy: Path) -> None:
    try:
        os.link(path, copy)  # takes no space on the same disk
    except OSError:
        shutil.copyfile(path, copy)
