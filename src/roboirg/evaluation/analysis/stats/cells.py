"""Results gathered into cells: one policy on one task with one set of instruction options.

Results under other conditions, or of other versions of the policy, the language or the
environment, go to cells of their own and are never averaged with the rest.
"""

from __future__ import annotations

import operator
from collections import defaultdict
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from fractions import Fraction
from typing import NamedTuple

import numpy as np

from roboirg.core.arms import TOLD
from roboirg.core.environment_options import ENVIRONMENT_OPTIONS, EnvironmentOptions
from roboirg.core.instruction_options import InstructionOptions
from roboirg.core.subgoal_text import BETWEEN_VERSIONS, SCRIPTED_HANDS
from roboirg.evaluation.analysis.stats.intervals import (
    DRAWS,
    Interval,
    Rows,
    resampled_interval,
    resampled_rates,
    wilson_interval,
)
from roboirg.evaluation.analysis.stats.option_labels import options_sort_key, words_label
from roboirg.evaluation.records.record import Job, Summary
from roboirg.evaluation.records.record_codec import RecordKey, identity_key
from roboirg.tasks import all_tasks


class Trial(NamedTuple):
    """One play of one episode."""

    episode: int
    policy_seed: int


class EvalConditions(NamedTuple):
    """The conditions under which a policy plays."""

    split: str
    environment: EnvironmentOptions = EnvironmentOptions()
    wordings: str | None = None
    arm: str = TOLD

    @classmethod
    def of(cls, job: Job) -> EvalConditions:
        return cls._make(_read_conditions(job))

    def value(self, name: str) -> object:
        """Return one of `CONDITIONS`."""
        return getattr(self.environment if name in ENVIRONMENT_OPTIONS else self, name)

    def text(self, name: str) -> str:
        """Return the value of a condition in words."""
        return words_label(self.wordings) if name == "wordings" else str(self.value(name))

    def label(self, name: str) -> str:
        """Return a condition with its value."""
        before = "" if name == "wordings" else f"{name.replace('_', ' ')} "
        return before + self.text(name)


_read_conditions = operator.attrgetter("split", "environment", "options.wordings", "arm")
CONDITIONS = ("split", *ENVIRONMENT_OPTIONS, "wordings", "arm")
"""The names of all conditions."""

FAIRNESS = {
    "split": "splits",
    "wordings": "words",
    "max_steps": "step limits",
    "meshes": "kinds of meshes",
    "arm": "arms",
}
"""Conditions that must be equal in a comparison, with their names in the plural."""


class Versions(NamedTuple):
    """The versions that a result depends on."""

    policy: str
    language: str
    environment: int

    @classmethod
    def of(cls, result: Summary) -> Versions:
        policy, server = result.policy_version, result.server_version
        return cls(
            policy if server is None else f"{policy} (server {server})",
            result.language_version,
            result.environment_version,
        )


PRIVILEGED = " (privileged)"
"""Mark of policies that read the simulator's state."""
HANDS = f" ({SCRIPTED_HANDS})"
"""Mark of planners whose hands read it, while they see pictures and words."""


class PolicyRun(NamedTuple):
    """One policy under one set of conditions and versions: results that may be averaged.

    Attributes:
        policy: its name.
        conditions: under which it played.
        versions: None before it has played.
        run: name of the run if several runs hold the same episodes, else empty.
        is_privileged: whether the policy read the simulator's state.
        robot: the real robot of a study; None in simulation.
    """

    policy: str
    conditions: EvalConditions
    versions: Versions | None
    run: str = ""
    is_privileged: bool = False
    robot: str | None = None

    @classmethod
    def of(cls, result: Summary, run: str = "") -> PolicyRun:
        return cls(
            result.policy,
            EvalConditions.of(result),
            Versions.of(result),
            run,
            result.privileged,
            result.robot,
        )

    @property
    def marked_policy(self) -> str:
        """The policy's name, marked if it is privileged."""
        return self.policy + self.mark

    @property
    def has_planner(self) -> bool:
        """Whether it has played as a planner with a policy."""
        return self.versions is not None and BETWEEN_VERSIONS in self.versions.policy

    @property
    def mark(self) -> str:
        """The mark of a privileged policy; empty for the others."""
        has_hands = self.versions is not None and SCRIPTED_HANDS in self.versions.policy
        return (HANDS if has_hands else PRIVILEGED) * self.is_privileged


class CellKey(NamedTuple):
    """Policy run, task and instruction options of a cell."""

    policy_run: PolicyRun
    task: str
    options: InstructionOptions


@dataclass(frozen=True, slots=True)
class CellResults:
    """The results of one cell.

    Attributes:
        verdicts: for each trial with a verdict, whether it succeeded.
        errors: trials that ended in an error and are in no rate.
        missing: planned trials without a result.
    """

    verdicts: Mapping[Trial, bool] = field(default_factory=dict)
    errors: int = 0
    missing: int = 0

    @property
    def trials(self) -> int:
        """Number of trials with a verdict."""
        return len(self.verdicts)

    @property
    def successes(self) -> int:
        """Number of trials that succeeded."""
        return sum(self.verdicts.values())

    @property
    def rate(self) -> Fraction | None:
        """Success rate, the mean over policy seeds; None without a verdict."""
        return Fraction(self.successes, self.trials) if self.trials else None

    @property
    def is_complete(self) -> bool:
        """Whether every planned trial has a verdict."""
        return self.trials > 0 and not self.errors and not self.missing

    def by_episode(self) -> dict[int, dict[int, bool]]:
        """Return the verdicts of each episode by policy seed."""
        episodes: dict[int, dict[int, bool]] = defaultdict(dict)
        for (episode, seed), won in self.verdicts.items():
            episodes[episode][seed] = won
        return dict(episodes)

    def rows(self) -> Rows:
        """Return successes and trials of each episode, shape (episodes, 2)."""
        counts = [
            (sum(seeds.values()), len(seeds)) for _, seeds in sorted(self.by_episode().items())
        ]
        return np.array(counts, dtype=np.int64).reshape(-1, 2)


Cells = Mapping[CellKey, CellResults]
"""The results of runs, by policy run, task and instruction options."""


def clustered_interval(
    tasks: Sequence[CellResults], rng: np.random.Generator, draws: int = DRAWS
) -> Interval | None:
    """Return the bootstrap interval, over episodes, of a success rate or its mean over tasks.

    Used with several policy seeds and for averages over tasks. None with fewer than two episodes
    per task on average, or if a task has none.
    """
    rows = [cell.rows() for cell in tasks]
    sizes = [len(each) for each in rows]
    if not sizes or 0 in sizes:
        return None
    return resampled_interval(resampled_rates(rows, rng, draws)[:, 0], sizes)


def cell_interval(cell: CellResults, rng: np.random.Generator) -> Interval | None:
    """Return the interval of a cell's rate: Wilson's, or clustered with several policy seeds."""
    if any(len(seeds) > 1 for seeds in cell.by_episode().values()):
        return clustered_interval([cell], rng)
    return wilson_interval(cell.successes, cell.trials) if cell.trials else None


def gather(runs: Sequence[tuple[str, Sequence[Summary]]], planned: Iterable[Job] = ()) -> Cells:
    """Gather the results of one or several runs into cells.

    Args:
        runs: each with its name; the results of a run have different identities. Runs that hold
            the same episodes of a policy stay apart; others complete each other.
        planned: jobs that should have a result; those without one are counted as missing.
    """
    jobs = {identity_key(job): job for job in planned}
    apart = _played_twice(runs) if len(runs) > 1 else set()
    verdicts: dict[CellKey, dict[Trial, bool]] = defaultdict(dict)
    errors: dict[CellKey, int] = defaultdict(int)
    missing: dict[CellKey, int] = defaultdict(int)
    policy_runs: dict[tuple[str, EvalConditions], PolicyRun] = {}
    played: set[RecordKey] = set()
    for name, results in runs:
        for result in results:
            policy_run = PolicyRun.of(result, name if result.policy in apart else "")
            policy_runs.setdefault((result.policy, policy_run.conditions), policy_run)
            if jobs:
                played.add(identity_key(result))
            key = CellKey(policy_run, result.task, result.column)
            if result.outcome == "error":
                errors[key] += 1
            else:
                trial = Trial(result.episode, result.policy_seed)
                verdicts[key][trial] = result.outcome == "success"
    unplayed_jobs = (job for key, job in jobs.items() if key not in played)
    for job in sorted(unplayed_jobs, key=lambda job: job.slug):
        conditions = EvalConditions.of(job)
        unplayed = PolicyRun(job.policy, conditions, None)
        policy_run = policy_runs.get((job.policy, conditions), unplayed)
        missing[CellKey(policy_run, job.task, job.column)] += 1
    keys = dict.fromkeys([*verdicts, *errors, *missing])
    return {key: CellResults(verdicts.get(key, {}), errors[key], missing[key]) for key in keys}


def only_told(cells: Cells) -> Cells:
    """Return the cells without those of control arms, if there are others."""
    found = {key: cell for key, cell in cells.items() if key.policy_run.conditions.arm == TOLD}
    return found or cells


def policy_order(
    cells: Cells, policies: Sequence[str], runs: Sequence[str] = ()
) -> list[PolicyRun]:
    """Return the policy runs in a reproducible order.

    Args:
        cells: of the policy runs.
        policies: names of policies in the wanted order; others follow by name.
        runs: names of runs in the wanted order, if policy runs are to be grouped by run.
    """

    def place(one: PolicyRun) -> tuple[object, ...]:
        rank = policies.index(one.policy) if one.policy in policies else len(policies)
        run = runs.index(one.run) if one.run in runs else 0
        versions = repr(one.versions)
        return (run, rank, one.policy, one.run, repr(one.conditions), versions, one.robot or "")

    return sorted({key.policy_run for key in cells}, key=place)


def task_order(names: Iterable[str]) -> list[str]:
    """Sort tasks in the order of the benchmark; unknown tasks come last."""
    known = list(all_tasks())
    return sorted(
        names, key=lambda name: (known.index(name) if name in known else len(known), name)
    )


def sort_cells(cells: Cells, policy_runs: Sequence[PolicyRun]) -> Cells:
    """Sort cells by policy run, task and options.

    The bootstrap draws for one cell after the other, and episodes end in any order.
    """
    tasks = task_order({key.task for key in cells})
    keys = sorted(
        cells,
        key=lambda key: (
            policy_runs.index(key.policy_run),
            tasks.index(key.task),
            options_sort_key(key.options),
        ),
    )
    return {key: cells[key] for key in keys}


def labels(cells: Cells) -> dict[PolicyRun, str]:
    """Return a label for each policy run, with what distinguishes runs of the same policy.

    Privileged policies are marked, because their rates are no rates of policies.
    """
    policy_runs = list(dict.fromkeys(key.policy_run for key in cells))
    return {one: _label(one, policy_runs) + one.mark for one in policy_runs}


def _label(policy_run: PolicyRun, policy_runs: Sequence[PolicyRun]) -> str:
    parts = [policy_run.policy]
    parts += [
        policy_run.conditions.label(name)
        for name in CONDITIONS
        if len({other.conditions.value(name) for other in policy_runs}) > 1
    ]
    parts += _version_labels(policy_run, policy_runs)
    if policy_run.robot is not None:
        parts.append(f"on {policy_run.robot}")
    if policy_run.run:
        parts.append(policy_run.run)
    return ", ".join(parts)


def _version_labels(policy_run: PolicyRun, policy_runs: Sequence[PolicyRun]) -> list[str]:
    """Return the versions in which a policy run differs from others."""
    if policy_run.versions is None:
        return []
    found = []
    for name in Versions._fields:
        # The version of a policy matters only among runs of the same policy.
        others = [one for one in policy_runs if name != "policy" or one.policy == policy_run.policy]
        if len({getattr(one.versions, name) for one in others if one.versions}) > 1:
            found.append(f"{name} {getattr(policy_run.versions, name)}")
    return found


def _played_twice(runs: Sequence[tuple[str, Sequence[Summary]]]) -> set[str]:
    """Return the policies of which several runs hold the same episode."""
    seen: set[RecordKey] = set()
    twice: set[str] = set()
    for _, results in runs:
        own = {identity_key(result): result.policy for result in results}
        twice |= {policy for key, policy in own.items() if key in seen}
        seen |= own.keys()
    return twice
