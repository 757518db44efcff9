"""Merge several runs into one folder."""

from __future__ import annotations

import os
import shutil
from collections.abc import Iterable, Iterator, Sequence
from pathlib import Path
from typing import NamedTuple

import msgspec

from roboirg.core.arms import TOLD
from roboirg.core.errors import InvalidValueError
from roboirg.core.versions import Versions
from roboirg.evaluation.records.action_log import action_path
from roboirg.evaluation.records.episode_log import log_path, logged_slugs
from roboirg.evaluation.records.film import poster_name
from roboirg.evaluation.records.mixing import mixtures
from roboirg.evaluation.records.record import Summary
from roboirg.evaluation.records.record_codec import (
    StoreError,
    encode,
    identity_key,
    read_record,
    read_summary,
)
from roboirg.evaluation.records.run_files import (
    MOST_PLAN_BYTES,
    keep_earlier_plan,
    plan_names,
    run_file,
)
from roboirg.evaluation.records.store import RecordStore, StoredRun
from roboirg.util.regular_file import read_regular


class MergeSummary(NamedTuple):
    """Result of a merge.

    Attributes:
        added: number of records added to the folder.
        duplicates: number of records whose episode was already there.
        conflicts: duplicates with another verdict than the one kept.
        warnings: what is mixed in the folder, in sentences.
    """

    added: int
    duplicates: int
    conflicts: tuple[Summary, ...]
    warnings: tuple[str, ...] = ()


def merge_runs(folders: Sequence[Path], out: Path) -> MergeSummary:
    """Copy the records, videos and logs of several runs into one folder.

    If several runs have the same episode, the first verdict is kept; a verdict replaces an error.
    Records are checked and copied one by one; the memory holds only their summaries.

    Args:
        folders: output folders of the runs; they are not changed.
        out: destination; may already hold records.

    Raises:
        InvalidValueError: `out` is one of the runs.
        StoreError: a file cannot be read or written, or versions differ.
    """
    if out.resolve() in {folder.resolve() for folder in folders}:
        raise InvalidValueError(f"{out} is one of the runs to be merged; choose another --out.")
    runs = [(folder, StoredRun(folder, _read_checked)) for folder in folders]
    entries = [(folder, run.newest) for folder, run in runs]
    _check_versions(entries)
    added, duplicates = 0, 0
    conflicts: list[Summary] = []
    with RecordStore(out) as store:
        _keep_plans(folders, out)
        kept = dict(store.stored)
        _check_versions([(out, kept.values()), *entries])
        for folder, run in runs:
            wanted = []
            for one in run.newest:
                before = kept.get(identity_key(one))
                if before is not None:
                    duplicates += 1
                    if before.outcome != "error":
                        if one.outcome not in ("error", before.outcome):
                            conflicts.append(one)
                        continue
                    if one.outcome == "error":
                        continue
                wanted.append(one)
                kept[identity_key(one)] = one
                added += before is None
            store.extend(_lines(run, wanted, folder, out))
    mixed = mixtures([one for one in kept.values() if one.arm == TOLD])
    return MergeSummary(added, duplicates, tuple(conflicts), tuple(mixed))


def _keep_plans(folders: Sequence[Path], out: Path) -> None:
    """Keep the plans of all runs, so that what is missing can be counted."""
    for folder in folders:
        for name in plan_names(folder):
            try:
                content = read_regular(run_file(folder, name), MOST_PLAN_BYTES)
            except OSError as error:
                raise StoreError(f"Cannot read {folder / name}: {error.strerror}.") from error
            keep_earlier_plan(content, out)


def _read_checked(line: bytes, path: Path, number: int) -> Summary:
    """Check that a line is a whole record and return its summary."""
    read_record(line, path, number)
    return read_summary(line, path, number)


def _check_versions(runs: Sequence[tuple[Path, Iterable[Summary]]]) -> None:
    """Refuse records of different versions, policies or scenes, as a run does."""
    known: dict[str, tuple[Path, Versions]] = {}
    for folder, results in runs:
        for result in results:
            owners = {
                "": Versions(environment_version=result.environment_version),
                f" of language {result.options.language}": Versions(
                    language_version=result.language_version
                ),
                f" of {result.words_owner}": Versions(words_version=result.words_version),
                f" of {result.policy}": result.policy_versions,
                f" of {result.task} {result.split} {result.episode}": Versions(seed=result.seed),
            }
            for owner, versions in owners.items():
                there, expected = known.setdefault(owner, (folder, versions))
                for what, value, other in versions.differences(expected):
                    raise StoreError(
                        f"{folder} and {there} cannot be merged: the {what}{owner} is {value} in "
                        f"the first and {other} in the second."
                    )
                if expected.server_version is None:  # an error came before it
                    known[owner] = folder, versions


def _lines(
    run: StoredRun[Summary], wanted: Sequence[Summary], source: Path, target: Path
) -> Iterator[bytes]:
    """Yield the lines of records and copy their videos, logs and actions.

    A video whose file is missing is removed from its line.
    """
    logs = logged_slugs(source)
    for one, line in zip(wanted, run.lines(wanted), strict=True):
        if logs and (slug := one.slug) in logs:
            _copy(log_path(Path(), slug).as_posix(), source, target)
        if one.action_log is not None:
            _copy(action_path(Path(), one.action_log).as_posix(), source, target)
        if one.video is None or _copy(one.video, source, target):
            if one.video is not None:
                _copy(poster_name(one.video), source, target)
            yield line
        else:
            record = next(run.records([one]))
            yield encode(msgspec.structs.replace(record, video=None))


def _copy(name: str, source: Path, target: Path) -> bool:
    """Copy a file over that of an error which is replaced; return whether it exists."""
    file, copy = run_file(source, name), run_file(target, name)
    if not file.is_file():
        return False
    copy.parent.mkdir(parents=True, exist_ok=True)
    copy.unlink(missing_ok=True)
    try:
        os.link(file.resolve(), copy)  # takes no space on the same disk
    except OSError:
        shutil.copyfile(file, copy)
    return True
