"""Verify a run: its records one by one, and that none of its plan is missing."""

from __future__ import annotations

import functools
import random
from collections import Counter, defaultdict
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
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
from roboirg.records.record import Summary
from roboirg.records.record_codec import RecordKey, identity_key, read_summary
from roboirg.records.store import StoredRun
from roboirg.runs.job_instruction import has_other_words
from roboirg.runs.plan.plan import Plan
from roboirg.runs.plan.stopping import find_stopping
from roboirg.runs.plan.stored_plans import read_kept_plans, read_plans
from roboirg.tasks.splits.private_splits import check_salt
from roboirg.util.parallel_map import parallel_map

Progress = Callable[[int, int], object]
Plans = Mapping[str | None, Plan]
"""Of all commands that wrote to a run, by their fingerprints."""


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
        faults: what does not hold of the run as a whole, in sentences.
    """

    records: int
    checks: tuple[RecordCheck, ...]
    missing: tuple[str, ...]
    verdicts: Counter[ReplayVerdict] = field(default_factory=Counter)
    deviation: float = 0.0
    errors: int = 0
    notes: tuple[str, ...] = ()
    faults: tuple[str, ...] = ()

    @property
    def holds(self) -> bool:
        """Whether nothing was found."""
        return not (self.checks or self.missing or self.faults)


def verify_run(
    folder: Path,
    *,
    sample: float = 1.0,
    seed: int | None = None,
    workers: int = 0,
    progress: Progress | None = None,
) -> Verification:
    """Check all records of a run, and play the actions of a sample of them.

    All records are checked for what follows from their jobs; those of the sample, also for what
    follows from their actions.

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
    entries = run.newest
    for split in sorted({entry.split for entry in entries}):
        check_salt(split)

    checks = _check_lines(_lines(run, sample, seed), folder, workers, progress)
    return _summed_up(folder, entries, checks)


def _summed_up(
    folder: Path, entries: Sequence[Summary], checks: Sequence[RecordCheck]
) -> Verification:
    """Return the result of a verification: of the checks of all records, and of the run's plans.

    Only checks with findings are kept, sorted, so that the result does not depend on their order.

    Args:
        folder: of the run, which has the plans.
        entries: all records.
        checks: of each record, in any order.
    """
    kept: Plans = {plan.fingerprint: plan for plan in read_kept_plans(folder)}
    plans = read_plans(folder)
    planned = _slugs(plans)
    failed = sorted(result for result in checks if result.findings)
    outcomes = Counter(entry.outcome for entry in entries)
    notes = [*_plan_notes(planned, kept, entries), *_excuses(failed, entries)]
    return Verification(
        records=len(entries),
        checks=tuple(failed),
        missing=_missing(planned, plans, entries),
        verdicts=Counter(result.replayed for result in checks),
        deviation=_largest_tolerated(checks),
        faults=tuple(_faults(kept, entries)),
        errors=outcomes["error"],
        notes=tuple(notes),
    )


def _missing(
    planned: Mapping[RecordKey, str], plans: Iterable[Plan], entries: Sequence[Summary]
) -> tuple[str, ...]:
    """Return the slugs of planned episodes that should have a record and have none, sorted."""
    found = {identity_key(entry) for entry in entries} | _spared(plans, entries)
    missing = {slug for key, slug in planned.items() if key not in found}
    return tuple(sorted(missing))


def _spared(plans: Iterable[Plan], entries: Sequence[Summary]) -> set[RecordKey]:
    """Return what identifies the episodes that plans need not play, as it was decided before."""
    spared: set[RecordKey] = set()
    for plan in plans:
        if plan.stop is None:
            continue
        jobs = plan.jobs()
        stopping = find_stopping(plan, jobs, entries)
        spared.update(identity_key(job) for job in jobs if not stopping.needs(job))
    return spared


def _largest_tolerated(checks: Iterable[RecordCheck]) -> float:
    """Return the largest difference of an end state that was tolerated; 0 if none was."""
    tolerated = [result.deviation for result in checks if result.replayed == "tolerant"]
    return max(tolerated, default=0.0)


def _excuses(failed: Sequence[RecordCheck], entries: Sequence[Summary]) -> Iterator[str]:
    """Yield why a record may not hold here, or was not checked, without being wrong.

    Args:
        failed: checks with findings.
        entries: all records.
    """
    elsewhere = [result for result in failed if result.elsewhere]
    if elsewhere:
        yield (
            f"Of those that do not hold, {len(elsewhere):,} were played on another kind of "
            "processor, where contacts can end differently: verify them on a machine of that kind."
        )
    unread = sum(map(has_other_words, entries))
    if unread:
        yield (
            f"Words, and why episodes failed, were not checked in {unread} of the records: this "
            "roboirg has other words."
        )


def _lines(run: StoredRun[Summary], sample: float, seed: int | None) -> Sequence[LineToCheck]:
    """Return the newest line of each episode; a random share of them is marked to be played.

    A share above 0 marks one line at least. `seed` None draws other lines each time.
    """
    total = len(run.newest)
    count = round(sample * total)
    if sample > 0:
        count = max(count, 1)  # a small share of a small run plays one, not none
    drawn = set(random.Random(seed).sample(range(total), count))
    lines = []
    for index, line in enumerate(run.lines(run.newest)):
        lines.append(LineToCheck(index + 1, line, index in drawn))
    return lines


def _check_lines(
    lines: Sequence[LineToCheck], folder: Path, workers: int, progress: Progress | None
) -> list[RecordCheck]:
    """Check the records in some lines; the results are in the order in which the checks end.

    Args:
        lines: of the records, each marked whether its actions are to be played.
        folder: of the run.
        workers: number of processes; 0 uses this one only.
        progress: is called with the number of checked lines, and of all.
    """
    checks = []
    check = functools.partial(check_line, folder=folder)
    for _, result in parallel_map(check, lines, workers):
        checks.append(result)
        if progress is not None:
            progress(len(checks), len(lines))
    return checks


def _plan_notes(
    planned: Mapping[RecordKey, str], kept: Plans, entries: Sequence[Summary]
) -> Iterator[str]:
    """Yield notes about earlier plans.

    A plan may be changed and the run continued. So records that only an earlier plan names, and
    episodes of an earlier plan that were never played, are no faults: the notes count them.

    Args:
        planned: the slugs of the newest plans' episodes, such as ``mine-PickXtimes-test-0-1a2b``,
            by what identifies them; empty without plans.
        kept: all plans of the run by fingerprint, which records name.
        entries: all records.
    """
    recorded = {identity_key(entry) for entry in entries}
    unplanned = recorded.difference(planned)
    if planned and unplanned:
        yield f"From an earlier plan: {counted(len(unplanned), 'record')}."
    named_plans = {entry.plan for entry in entries} & kept.keys()
    planned_at_some_time = _slugs([kept[name] for name in named_plans])
    unplayed = planned_at_some_time.keys() - recorded - planned.keys()
    if unplayed:
        yield f"Earlier plans name {counted(len(unplayed), 'more episode')}, not played."


def _slugs(plans: Iterable[Plan]) -> dict[RecordKey, str]:
    """Return the names (slugs) of the episodes of some plans, by what identifies them."""
    slugs = {}
    for plan in plans:
        for job in plan.jobs():
            slugs[identity_key(job)] = job.slug
    return slugs


def _faults(kept: Plans, entries: Sequence[Summary]) -> Iterator[str]:
    """Yield a sentence for each way in which records contradict their plans or each other.

    A record names its plan and its words. The plan must be kept in the run, and name these words;
    and all records of one task and pool (`words_owner`) must have the same words.
    """
    unplanned = 0  # records whose plan is not kept
    unnamed = 0  # records with words that their plan does not name
    words_by_owner = defaultdict(set)
    for entry in entries:
        plan = kept.get(entry.plan)
        if entry.plan not in kept:
            unplanned += 1
        if plan and plan.words and entry.words not in plan.words:
            unnamed += 1
        words_by_owner[entry.words_owner].add(entry.words)

    if unplanned:
        yield f"{counted(unplanned, 'record')} from no plan that is kept."
    if unnamed:
        yield f"{counted(unnamed, 'record')} in words that the plan does not name."
    for owner, words in sorted(words_by_owner.items()):
        if len(words) > 1:
            yield f"The records have several words of {owner}: {', '.join(sorted(words))}."
