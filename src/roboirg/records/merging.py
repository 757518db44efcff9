"""Merge several runs into one folder."""

from __future__ import annotations

import os
import shutil
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import NamedTuple

import msgspec

from roboirg.core.arms import TOLD
from roboirg.core.errors import InvalidValueError
from roboirg.core.versions import Versions
from roboirg.records.action_log import action_path
from roboirg.records.episode_log import log_path, logged_slugs
from roboirg.records.film import poster_name
from roboirg.records.mixing import mixtures
from roboirg.records.record import Summary
from roboirg.records.record_codec import (
    RecordKey,
    StoreError,
    encode,
    identity_key,
    read_record,
    read_summary,
)
from roboirg.records.run_files import (
    MOST_PLAN_BYTES,
    keep_earlier_plan,
    plan_names,
    run_file,
)
from roboirg.records.store import RecordStore, StoredRun, check_same
from roboirg.util.regular_file import read_regular


@dataclass
class Merge:
    """A merge: which results it has kept so far, and counts of those that it has seen.

    Attributes:
        kept: the results of the merged run, by identity of their episodes.
        added: number of episodes that were new.
        duplicates: number of results whose episode was kept before.
        conflicts: duplicates whose verdict differs from the one that is kept.
    """

    kept: dict[RecordKey, Summary]
    added: int = 0
    duplicates: int = 0
    conflicts: list[Summary] = field(default_factory=list)

    def warnings(self) -> list[str]:
        """Return what is mixed in the merged run, in sentences."""
        # Other arms are controls, in which words or seeds differ on purpose.
        return mixtures([result for result in self.kept.values() if result.arm == TOLD])

    def keep_new(self, results: Iterable[Summary]) -> list[Summary]:
        """Keep results of one run; return those that must be copied into the merged run.

        They are those of new episodes, and verdicts (success or failure) that replace an error. The
        first verdict of an episode stays; a different one is noted in `conflicts`.
        """
        taken = []
        for result in results:
            key = identity_key(result)
            earlier = self.kept.get(key)
            if earlier is None:
                self.added += 1
            else:
                self.duplicates += 1
                if {earlier.outcome, result.outcome} == {"success", "failure"}:  # one of each
                    self.conflicts.append(result)
                replaces_error = earlier.outcome == "error" and result.outcome != "error"
                if not replaces_error:
                    continue
            self.kept[key] = result
            taken.append(result)
        return taken


def merge_runs(folders: Sequence[Path], out: Path) -> Merge:
    """Copy the records, videos and logs of several runs into one folder.

    If several runs have the same episode, the first verdict (success or failure) is kept; a verdict
    replaces an error. Records are checked and copied one by one; the memory holds only their
    summaries. All runs are checked before the first is copied.

    Args:
        folders: output folders of the runs, the first with precedence; they are not changed.
        out: destination; may already hold records, which come before all others.

    Raises:
        InvalidValueError: `out` is one of the runs.
        StoreError: a file cannot be read or written, or versions differ.
    """
    if out.resolve() in [folder.resolve() for folder in folders]:
        raise InvalidValueError(f"{out} is one of the runs to be merged; choose another --out.")
    runs = [(folder, StoredRun(folder, _read_checked)) for folder in folders]
    results = [(folder, run.newest) for folder, run in runs]
    _check_versions(results)  # before `out` is made, and then with the records that it has
    with RecordStore(out) as store:
        _keep_plans(folders, out)
        _check_versions([(out, store.stored.values()), *results])
        merged = Merge(dict(store.stored))
        for folder, run in runs:
            taken = merged.keep_new(run.newest)
            store.extend(_copied_lines(run, taken, folder, out))
    return merged


def _keep_plans(folders: Sequence[Path], out: Path) -> None:
    """Copy the plans of all runs into the merged one, so that missing episodes can be counted.

    Raises:
        StoreError: a plan cannot be read.
    """
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


class _Expected(NamedTuple):
    """The versions that all folders must have, and the folder where they were found first."""

    folder: Path
    versions: Versions


def _check_versions(runs: Iterable[tuple[Path, Iterable[Summary]]]) -> None:
    """Raise if results cannot be in one run, because they were made with different versions.

    The versions of environment and language must be equal in all results; that of words in those of
    a task and pool of words; those of a policy in its results; a scene's seed in those of its
    episode. What shares versions is called their owner here; each owner's versions are compared
    with the first that were found.

    Args:
        runs: folders, and the results in them.

    Raises:
        StoreError: versions differ.
    """
    known: dict[str, _Expected] = {}
    for folder, results in runs:
        for result in results:
            owners = {  # as the error names them; "" is everything
                "": Versions(
                    environment_version=result.environment_version,
                    language_version=result.language_version,
                ),
                f" of {result.words_owner}": Versions(words_version=result.words),
                f" of {result.policy}": result.policy_versions,
                f" of {result.task} {result.split} {result.episode}": Versions(seed=result.seed),
            }
            for owner, versions in owners.items():
                found = _Expected(folder, versions)
                expected = known.setdefault(owner, found)
                if versions != expected.versions:
                    check_same(
                        f"{folder} holds episodes{owner}",
                        versions.differences(expected.versions),
                        f"in {expected.folder}",
                        "they cannot be merged",
                    )
                if expected.versions.server_version is None:
                    # An error may come before the server's version is known: take it from here.
                    known[owner] = found


def _copied_lines(
    run: StoredRun[Summary], wanted: Sequence[Summary], source: Path, target: Path
) -> Iterator[bytes]:
    """Yield the lines of records for another folder, and copy their files into it.

    The videos, logs and actions of a record are copied before its line is yielded, so a stored line
    has its files. If the file of a video is missing, the line is yielded without it.

    Args:
        run: with the records.
        wanted: those to copy.
        source: folder of the run.
        target: folder to copy to.
    """
    logs = logged_slugs(source)
    for result, line in zip(wanted, run.lines(wanted), strict=True):
        if logs:
            slug = result.slug  # slow to make
            if slug in logs:
                _copy(log_path(Path(), slug).as_posix(), source, target)
        if result.action_log is not None:
            _copy(action_path(Path(), result.action_log).as_posix(), source, target)
        if result.video is None:
            yield line
        elif _copy(result.video, source, target):
            _copy(poster_name(result.video), source, target)
            yield line
        else:
            record = next(run.records([result]))
            yield encode(msgspec.structs.replace(record, video=None))


def _copy(name: str, source: Path, target: Path) -> bool:
    """Copy a file of a run into another run, if it exists; return whether it does.

    A file of that name is replaced, as it may belong to an error that a verdict replaces.

    Args:
        name: path of the file relative to the folder of a run.
        source: folder of the run.
        target: folder of the other run.
    """
    file = run_file(source, name)
    copy = run_file(target, name)
    if not file.is_file():
        return False
    copy.parent.mkdir(parents=True, exist_ok=True)
    copy.unlink(missing_ok=True)
    try:
        os.link(file.resolve(), copy)  # takes no space on the same disk
    except OSError:
        shutil.copyfile(file, copy)
    return True
