"""Results sorted into samples: who played which task, told in which way.

What was played under other rules, or by another version of the policy, the words or the worlds, is
a sample of its own and never averaged with the rest.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from fractions import Fraction
from typing import NamedTuple

import numpy as np

from roboirg.analysis.stats.intervals import (
    DRAWS,
    Interval,
    Rows,
    percentile_interval,
    resampled_rates,
    wilson_interval,
    without_spread,
)
from roboirg.analysis.stats.success_rates import SettingColumn
from roboirg.core.observations import DemonstrationFrames
from roboirg.records.record import DEFAULT_MAX_STEPS, DEFAULT_MESHES, Job, Result


class Trial(NamedTuple):
    """One play of one episode."""

    episode: int
    policy_seed: int


class EvalConditions(NamedTuple):
    """Under which rules a policy played."""

    split: str
    max_steps: int = DEFAULT_MAX_STEPS
    actions: str | None = None
    demonstration_frames: DemonstrationFrames | None = None
    observe_every: int | None = None
    meshes: str = DEFAULT_MESHES

    @classmethod
    def of(cls, job: Job) -> EvalConditions:
        """The rules of a job."""
        return cls(**{name: getattr(job, name) for name in cls._fields})


class Versions(NamedTuple):
    """Of which versions a result is."""

    policy: str
    language: str
    environment: int

    @classmethod
    def of(cls, result: Result) -> Versions:
        """The versions of a result."""
        return cls(result.policy_version, result.language_version, result.environment_version)


class PolicyRun(NamedTuple):
    """Whose results may be averaged: one policy, under the same rules, of the same versions.

    Attributes:
        policy: its name.
        rules: under which it played.
        versions: None while nothing was played.
        run: of several runs that hold the same episodes, the name of the run; else empty.
    """

    policy: str
    rules: EvalConditions
    versions: Versions | None
    run: str = ""


@dataclass(frozen=True, slots=True)
class CellResults:
    """What came of one task told in one way.

    Attributes:
        verdicts: of every trial that has one, whether it succeeded.
        errors: trials that say nothing about the policy; in no rate.
        missing: trials of the plan that were not played.
    """

    verdicts: Mapping[Trial, bool] = field(default_factory=dict)
    errors: int = 0
    missing: int = 0

    @property
    def trials(self) -> int:
        """With a verdict."""
        return len(self.verdicts)

    @property
    def successes(self) -> int:
        """Trials that succeeded."""
        return sum(self.verdicts.values())

    @property
    def rate(self) -> Fraction | None:
        """Success rate, the mean over policy seeds; None without a verdict."""
        return Fraction(self.successes, self.trials) if self.trials else None

    @property
    def is_complete(self) -> bool:
        """Whether every trial of the plan has a verdict."""
        return self.trials > 0 and not self.errors and not self.missing

    def by_episode(self) -> dict[int, dict[int, bool]]:
        """The verdicts of each episode by policy seed."""
        episodes: dict[int, dict[int, bool]] = defaultdict(dict)
        for (episode, seed), won in self.verdicts.items():
            episodes[episode][seed] = won
        return dict(episodes)

    def rows(self) -> Rows:
        """Successes and trials of each episode, shape (episodes, 2)."""
        counts = [
            (sum(seeds.values()), len(seeds)) for _, seeds in sorted(self.by_episode().items())
        ]
        return np.array(counts, dtype=np.int64).reshape(-1, 2)


Samples = Mapping[tuple[PolicyRun, str, SettingColumn], CellResults]
"""By contestant, task and how it was told."""


def wilson(sample: CellResults) -> Interval | None:
    """Wilson's interval on trials: the one to show with one policy seed."""
    return wilson_interval(sample.successes, sample.trials) if sample.trials else None


def clustered_interval(
    tasks: Sequence[CellResults], rng: np.random.Generator, draws: int = DRAWS
) -> Interval | None:
    """The bootstrap interval, over episodes, of a success rate or its mean over tasks.

    The one to show with several policy seeds, and for averages over tasks. None with fewer than
    two episodes of a task on average, or a task without any.
    """
    rows = [sample.rows() for sample in tasks]
    sizes = [len(each) for each in rows]
    if not sizes or 0 in sizes:
        return None
    values = resampled_rates(rows, rng, draws)[:, 0]
    interval = percentile_interval(values, sizes)
    if interval is not None and np.ptp(values) == 0:
        return without_spread(float(values[0]), sum(sizes))
    return interval


def shown_interval(sample: CellResults, rng: np.random.Generator) -> Interval | None:
    """The interval that stands beside a cell's rate: Wilson's, or clustered with several seeds."""
    several = any(len(seeds) > 1 for seeds in sample.by_episode().values())
    return clustered_interval([sample], rng) if several else wilson(sample)


def gather(runs: Sequence[tuple[str, Sequence[Result]]], planned: Iterable[Job] = ()) -> Samples:
    """The samples of one or several runs.

    Args:
        runs: each with its name; the results of a run have different identities. Runs that hold
            the same episodes of a policy stand apart, others complete each other.
        planned: jobs that should have been played; what has no result is counted as missing.
    """
    jobs = set(planned)
    apart = _played_twice(runs) if len(runs) > 1 else set()
    verdicts: dict[tuple[PolicyRun, str, SettingColumn], dict[Trial, bool]] = defaultdict(dict)
    errors: dict[tuple[PolicyRun, str, SettingColumn], int] = defaultdict(int)
    missing: dict[tuple[PolicyRun, str, SettingColumn], int] = defaultdict(int)
    contestants: dict[tuple[str, EvalConditions], PolicyRun] = {}
    played: set[Job] = set()
    for name, results in runs:
        for result in results:
            rules = EvalConditions.of(result)
            run = name if result.policy in apart else ""
            who = PolicyRun(result.policy, rules, Versions.of(result), run)
            contestants.setdefault((result.policy, rules), who)
            if jobs:
                played.add(result.identity)
            key = (who, result.task, SettingColumn.of(result))
            if result.outcome == "error":
                errors[key] += 1
            else:
                trial = Trial(result.episode, result.policy_seed)
                verdicts[key][trial] = result.outcome == "success"
    for job in sorted(jobs - played, key=lambda job: job.slug):
        rules = EvalConditions.of(job)
        who = contestants.get((job.policy, rules), PolicyRun(job.policy, rules, None))
        missing[who, job.task, SettingColumn.of(job)] += 1
    keys = dict.fromkeys([*verdicts, *errors, *missing])
    return {key: CellResults(verdicts.get(key, {}), errors[key], missing[key]) for key in keys}


def labels(samples: Samples) -> dict[PolicyRun, str]:
    """A name for each contestant, with what tells those of the same policy apart."""
    contestants = list(dict.fromkeys(who for who, _, _ in samples))
    return {who: _label(who, contestants) for who in contestants}


def _label(who: PolicyRun, contestants: Sequence[PolicyRun]) -> str:
    parts = [who.policy]
    twins = [other for other in contestants if other.policy == who.policy]
    parts += [
        f"{name.replace('_', ' ')} {getattr(who.rules, name)}"
        for name in EvalConditions._fields
        if len({getattr(other.rules, name) for other in contestants}) > 1
    ]
    if who.versions is not None:
        for name in Versions._fields:
            # Policies of two names have other versions anyway; words and worlds should not.
            others = twins if name == "policy" else contestants
            if len({getattr(one.versions, name) for one in others if one.versions}) > 1:
                parts.append(f"{name} {getattr(who.versions, name)}")
    if who.run:
        parts.append(who.run)
    return ", ".join(parts)


def _played_twice(runs: Sequence[tuple[str, Sequence[Result]]]) -> set[str]:
    """Policies of which several runs hold the same episode."""
    seen: set[Job] = set()
    twice: set[str] = set()
    for _, results in runs:
        own = {result.identity for result in results}
        twice |= {job.policy for job in own & seen}
        seen |= own
    return twice
