"""Verify a run: its records one by one, and that none of its plan is missing."""

from __future__ import annotations

import functools
import random
from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from pathlib import Path

from roboirg.apps.leaderboard.record_check import (
    LineToCheck,
    RecordCheck,
    ReplayVerdict,
    check_line,
)
from roboirg.core.errors import InvalidValueError
from roboirg.core.plain_text import counted
from roboirg.evaluation.plan.stored_plans import read_plans
from roboirg.evaluation.play.job_instruction import has_other_words
from roboirg.evaluation.records.record import Summary
from roboirg.evaluation.records.record_codec import identity_key, read_summary
from roboirg.evaluation.records.store import StoredRun
from roboirg.tasks.splits.private_splits import check_salt
from roboirg.util.parallel_map import parallel_map

Progress = Callable[[int, int], object]


@dataclass(frozen=True)
class Verification:
    """What was found in a run.

    Attributes:
        records: number of records.
        checks: of the records with findings.
        missing: slugs of the plan's episodes that have no record.
        verdicts: how many ends compare how.
        deviation: largest difference of an end state that was tolerated, in m, rad and s.
        errors: number of records that are errors: never counted as failures, so too many of them
            would embellish the rates.
        notes: what is worth knowing and not wrong.
    """

    records: int
    checks: tuple[RecordCheck, ...]
    missing: tuple[str, ...]
    verdicts: Counter[ReplayVerdict] = field(default_factory=Counter)
    deviation: float = 0.0
    errors: int = 0
    notes: tuple[str, ...] = ()

    @property
    def holds(self) -> bool:
        """Whether nothing was found."""
        return not (self.checks or self.missing)


def verify_run(
    folder: Path,
    *,
    sample: float = 1.0,
    seed: int | None = None,
    workers: int = 0,
    progress: Progress | None = None,
) -> Verification:
    """Check all records of a run, and play the actions of a sample of them.

    Args:
        folder: output folder of the run.
        sample: share of the episodes that are played, 0 to 1.
        seed: which episodes are drawn; None draws them anew each time.
        workers: number of processes; 0 uses this one only.
        progress: is called with the number of checked records, and of all.

    Raises:
        InvalidValueError: the sample is not a share.
        MissingSaltError: the run has private episodes, and their salt is not known.
        StoreError: there are no records, or a line is damaged or no record of this schema version.
    """
    if not 0.0 <= sample <= 1.0:
        raise InvalidValueError(f"sample is {sample}; it must be between 0 % and 100 %.")
    run = StoredRun(folder, read_summary)
    run.file.refuse_damage()
    for split in sorted({one.split for one in run.newest}):
        check_salt(split)
    checks: list[RecordCheck] = []
    verdicts: Counter[ReplayVerdict] = Counter()
    deviation = 0.0
    work = functools.partial(check_line, folder=folder)
    results = parallel_map(work, _lines(run, sample, seed), workers)
    for done, (_, check) in enumerate(results, start=1):
        if progress is not None:
            progress(done, len(run.newest))
        verdicts[check.replayed] += 1
        if check.replayed == "tolerant":
            deviation = max(deviation, check.deviation)
        if check.findings:
            checks.append(check)
    missing, notes = _completeness(folder, run.newest)
    if moved := sum(one.elsewhere for one in checks):
        notes.append(
            f"Of those that do not hold, {moved:,} were played on another kind of processor, where "
            "contacts can end differently: verify them on a machine of that kind."
        )
    if unread := sum(map(has_other_words, run.newest)):
        notes.append(
            f"Words, and why episodes failed, were not checked in {unread} of the records: this "
            "roboirg has other words."
        )
    return Verification(
        records=len(run.newest),
        checks=tuple(sorted(checks)),
        missing=missing,
        verdicts=verdicts,
        deviation=deviation,
        errors=sum(one.outcome == "error" for one in run.newest),
        notes=tuple(notes),
    )


def _lines(run: StoredRun[Summary], sample: float, seed: int | None) -> Sequence[LineToCheck]:
    """Return the newest lines, with a share of them to play."""
    count = round(sample * len(run.newest))
    if sample > 0:
        count = max(count, 1)
    drawn = set(random.Random(seed).sample(range(len(run.newest)), count))
    return [
        LineToCheck(index + 1, line, index in drawn)
        for index, line in enumerate(run.lines(run.newest))
    ]


def _completeness(folder: Path, entries: Sequence[Summary]) -> tuple[tuple[str, ...], list[str]]:
    """Return which episodes are missing, and notes about the plan."""
    plans = read_plans(folder)
    jobs = {identity_key(job): job.slug for plan in plans for job in plan.jobs()}
    there = {identity_key(one) for one in entries}
    missing = {slug for key, slug in jobs.items() if key not in there}
    notes = []
    if outside := len(there - jobs.keys()):
        whose = "an earlier plan" if plans else "no plan that is kept"
        notes.append(f"From {whose}: {counted(outside, 'record')}.")
    return tuple(sorted(missing)), notes
