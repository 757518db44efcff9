"""Verify a run: its records one by one, and that none is missing or doubled."""

from __future__ import annotations

import functools
import random
from collections import Counter, defaultdict
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass, field
from pathlib import Path

from roboirg.apps.leaderboard.record_check import (
    LineToCheck,
    RecordCheck,
    ReplayVerdict,
    check_line,
)
from roboirg.core.errors import InvalidValueError, RoboIRGError
from roboirg.core.instruction_options import InstructionOptions
from roboirg.core.plain_text import counted
from roboirg.evaluation.analysis.stats.option_labels import options_label
from roboirg.evaluation.plan.stored_plans import kept_fingerprints, read_plans
from roboirg.evaluation.records.record import Summary
from roboirg.evaluation.records.record_codec import identity_key
from roboirg.evaluation.records.store import StoredRun, read_summaries
from roboirg.language.arms import say_arm
from roboirg.tasks.splits.private_splits import check_salt
from roboirg.tasks.splits.splits import get_episode
from roboirg.util.parallel_map import parallel_map

Progress = Callable[[int, int], object]
_CellName = tuple[str, str, str, InstructionOptions, str]
"""Policy, task, split, options and arm."""


@dataclass(frozen=True)
class Verification:
    """What was found in a run.

    Attributes:
        records: number of records.
        checks: of the records with findings.
        missing: slugs or descriptions of episodes that have no record.
        doubled: slugs of episodes with more than one verdict.
        verdicts: how many ends compare how.
        deviation: largest difference of an end state that was tolerated, in m, rad and s.
        errors: number of records that are errors: never counted as failures, so too many of them
            would embellish the rates.
        notes: what is worth knowing and not wrong.
    """

    records: int
    checks: tuple[RecordCheck, ...]
    missing: tuple[str, ...]
    doubled: tuple[str, ...]
    verdicts: Counter[ReplayVerdict] = field(default_factory=Counter)
    deviation: float = 0.0
    errors: int = 0
    notes: tuple[str, ...] = ()

    @property
    def holds(self) -> bool:
        """Whether nothing was found."""
        return not (self.checks or self.missing or self.doubled)


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
        StoreError: there are no records, or a line is not a record of this schema version.
    """
    if not 0.0 <= sample <= 1.0:
        raise InvalidValueError(f"sample is {sample}; it must be between 0 % and 100 %.")
    run = read_summaries(folder)
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
        if check.replayed is ReplayVerdict.TOLERANT:
            deviation = max(deviation, check.deviation)
        if check.findings:
            checks.append(check)
    missing, notes = _completeness(folder, run.newest)
    if moved := sum(one.elsewhere for one in checks):
        elsewhere = (
            f"Of those that do not hold, {moved:,} were played on another kind of processor, where "
            "contacts can end differently: verify them on a machine of that kind."
        )
        notes = (*notes, elsewhere)
    return Verification(
        records=len(run.newest),
        checks=tuple(sorted(checks)),
        missing=missing,
        doubled=tuple(sorted({one.slug for one in run.replaced if one.outcome != "error"})),
        verdicts=verdicts,
        deviation=deviation,
        errors=sum(one.outcome == "error" for one in run.newest),
        notes=notes,
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


def _completeness(
    folder: Path, entries: Sequence[Summary]
) -> tuple[tuple[str, ...], tuple[str, ...]]:
    """Return which episodes are missing, and notes about the plan."""
    plans = read_plans(folder)
    made_by = {one.plan for one in entries if one.plan is not None}
    unknown = made_by - kept_fingerprints(folder)
    missing = {f"the plan {one}, by which episodes were played" for one in unknown}
    jobs = {identity_key(job): job.slug for plan in plans for job in plan.jobs()}
    missing |= set(_holes(one for one in entries if identity_key(one) not in jobs))
    there = {identity_key(one) for one in entries}
    missing |= {slug for key, slug in jobs.items() if key not in there}
    notes = []
    if outside := len(there - jobs.keys()):
        whose = "an earlier plan" if plans else "no plan that is kept"
        notes.append(f"From {whose}: {counted(outside, 'record')}.")
    return tuple(sorted(missing)), tuple(notes)


def _holes(entries: Iterable[Summary]) -> Iterator[str]:
    """Yield episodes that a policy played in one setting or seed of a task, but not in another.

    Only within one plan: a folder may hold commands with other settings, episodes and seeds.
    """
    plans: dict[str | None, list[Summary]] = defaultdict(list)
    for one in entries:
        plans[one.plan].append(one)
    for played in plans.values():
        yield from _holes_of_plan(played)


def _holes_of_plan(entries: Iterable[Summary]) -> Iterator[str]:
    episodes: dict[tuple[str, ...], set[int]] = defaultdict(set)
    seeds: dict[str, set[int]] = defaultdict(set)
    cells: dict[_CellName, set[tuple[int, int]]] = defaultdict(set)
    for one in entries:
        episodes[one.policy, one.task, one.split].add(one.episode)
        seeds[one.policy].add(one.policy_seed)
        played = cells[one.policy, one.task, one.split, one.column, one.arm]
        played.add((one.episode, one.policy_seed))
    for (policy, task, split, options, arm), played in cells.items():
        for episode in sorted(episodes[policy, task, split]):
            lacking = {seed for seed in seeds[policy] if (episode, seed) not in played}
            if not lacking or not _is_expressible(task, split, episode, options, arm):
                continue
            for seed in sorted(lacking):
                words = f"{options_label(options)}, {arm}"
                yield f"{policy} {task} {split}/{episode} ({words}), policy seed {seed}"


def _is_expressible(
    task: str, split: str, episode: int, options: InstructionOptions, arm: str
) -> bool:
    """Return whether an episode exists and has words; what has none is named by its record."""
    try:
        say_arm(get_episode(task, split, episode), options, arm)
    except RoboIRGError:
        return False
    return True
