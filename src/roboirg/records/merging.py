"""Several runs made into one."""

from __future__ import annotations

import contextlib
import os
import shutil
from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

from roboirg.core.errors import InvalidValueError
from roboirg.records.record import Record
from roboirg.records.record_codec import RecordKey, StoreError, identity_key
from roboirg.records.store import RecordStore, read_records


class MergeSummary(NamedTuple):
    """What came of merging.

    Attributes:
        added: records that are new in the folder.
        doubled: episodes that were there already, or in several runs.
        disputed: of those, the ones whose verdicts differ; the first one's stays.
    """

    added: int
    doubled: int
    disputed: tuple[Record, ...]


def merge_runs(folders: Sequence[Path], out: Path) -> MergeSummary:
    """Put the records of several runs, and their films, into one folder.

    An episode that several of them have keeps the first verdict; an error gives way to a verdict.

    Args:
        folders: of the runs; they stay as they are.
        out: gets the records; may be one that has some.

    Raises:
        InvalidValueError: `out` is one of the runs.
        StoreError: something cannot be read or written, or versions differ.
    """
    if out.resolve() in {folder.resolve() for folder in folders}:
        raise InvalidValueError(f"{out} is one of the runs to be merged; choose another --out.")
    runs = [(folder, read_records(folder)) for folder in folders]
    _check_versions(runs)
    added, doubled, disputed = 0, 0, []
    with RecordStore(out) as store:
        kept: dict[RecordKey, Record] = {}
        if store.stored:
            runs_so_far = read_records(out)
            _check_versions([(out, runs_so_far), *runs])
            kept = {identity_key(record): record for record in runs_so_far}
        for folder, records in runs:
            for record in records:
                before = kept.get(identity_key(record))
                if before is not None:
                    doubled += 1
                    if before.outcome != "error":
                        if record.outcome not in ("error", before.outcome):
                            disputed.append(record)
                        continue
                    if record.outcome == "error":
                        continue
                store.append(_copy_video(record, folder, out))
                kept[identity_key(record)] = record
                added += before is None
    return MergeSummary(added, doubled, tuple(disputed))


def _check_versions(runs: Sequence[tuple[Path, Sequence[Record]]]) -> None:
    """Refuse what no run would have mixed either."""
    first: dict[object, tuple[Path, object]] = {}
    for folder, records in runs:
        for record in records:
            for what, value in (
                (("language version",), record.language_version),
                (("environment version",), record.environment_version),
                (("version", "of policy", record.policy), record.policy_version),
                (("seed", "of", record.task, record.split, record.episode), record.seed),
            ):
                there, expected = first.setdefault(what, (folder, value))
                if value != expected:
                    raise StoreError(
                        f"{folder} and {there} do not go together: the "
                        f"{' '.join(map(str, what))} is {value!r} here and {expected!r} there."
                    )


def _copy_video(record: Record, source: Path, target: Path) -> Record:
    """The record, after its film has come along; without a film if that is gone."""
    if record.video is None:
        return record
    film, place = source / record.video, target / record.video
    if not film.is_file():
        return record.model_copy(update={"video": None})
    if place.exists():
        return record
    place.parent.mkdir(parents=True, exist_ok=True)
    for path, copy in ((film, place), (film.with_suffix(".jpg"), place.with_suffix(".jpg"))):
        with contextlib.suppress(FileNotFoundError):
            _copy(path, copy)
    return record


def _copy(path: Path, copy: Path) -> None:
    try:
        os.link(path, copy)  # costs nothing on the same disk
    except OSError:
        shutil.copyfile(path, copy)
