"""Every figure of a run: for each policy and telling, each task, suite, and all tasks together."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from fractions import Fraction
from typing import NamedTuple

import numpy as np

from roboirg.analysis.stats.intervals import Interval
from roboirg.analysis.stats.multiple_testing import holm
from roboirg.analysis.stats.paired_tests import Gap, Pairs, measure_gap
from roboirg.analysis.stats.samples import (
    CellResults,
    PolicyRun,
    Samples,
    clustered_interval,
    shown_interval,
    wilson,
)
from roboirg.analysis.stats.success_rates import EXPLICIT, SettingColumn
from roboirg.tasks import all_tasks


class Scope(NamedTuple):
    """What a figure is about: one task, the tasks of a suite, or all tasks (both None)."""

    task: str | None = None
    suite: str | None = None


ALL = Scope()


@dataclass(frozen=True, slots=True)
class SummaryRow:
    """What one policy reached in one scope, told in one way.

    Attributes:
        contestant: who played.
        scope: where.
        variant: how it was told.
        tasks: that have a verdict.
        successes: trials.
        trials: with a verdict.
        episodes: with a verdict.
        errors: trials that ended in an error.
        missing: trials of the plan without a result.
        rate: of one task the share of its trials, of several the unweighted mean; None without.
        interval: the one to show: of a task with one policy seed Wilson's, else the bootstrap.
        wilson: of a task: Wilson's interval, as if all its trials were independent.
        gap: to the explicit setting on the same episodes; None for that itself or without pairs.
        p_holm: its p-value after Holm's correction over all tasks' cells of the policy, or over
            all its suites, or over all its averages.
        form_gap: the implicit form less the resolved one on the same episodes, of an implicit
            variant that was played in both forms.
    """

    contestant: PolicyRun
    scope: Scope
    variant: SettingColumn
    tasks: tuple[str, ...]
    successes: int
    trials: int
    episodes: int
    errors: int
    missing: int
    rate: Fraction | None
    interval: Interval | None
    wilson: Interval | None
    gap: Gap | None
    p_holm: float | None
    form_gap: Gap | None

    @property
    def is_complete(self) -> bool:
        """Whether every trial of the plan has a verdict."""
        return self.trials > 0 and not self.errors and not self.missing


def summarize(samples: Samples, rng: np.random.Generator) -> tuple[SummaryRow, ...]:
    """All figures, in the order of the samples: tasks first, then suites, then everything."""
    found = [
        _summary(who, scope, variant, cells, samples, rng)
        for (who, scope, variant), cells in _scopes(samples).items()
    ]
    return _corrected(found)


def _scopes(
    samples: Samples,
) -> Mapping[tuple[PolicyRun, Scope, SettingColumn], list[tuple[str, CellResults]]]:
    suites = {task.name: task.suite for task in all_tasks().values()}
    levels: list[dict[tuple[PolicyRun, Scope, SettingColumn], list[tuple[str, CellResults]]]] = [
        {},
        {},
        {},
    ]
    for (who, task, variant), sample in samples.items():
        scopes = (Scope(task=task), Scope(suite=suites.get(task, "")), ALL)
        for level, scope in zip(levels, scopes, strict=True):
            if scope != Scope(suite=""):
                level.setdefault((who, scope, variant), []).append((task, sample))
    return levels[0] | levels[1] | levels[2]


def _summary(
    who: PolicyRun,
    scope: Scope,
    variant: SettingColumn,
    cells: Sequence[tuple[str, CellResults]],
    samples: Samples,
    rng: np.random.Generator,
) -> SummaryRow:
    judged = [(task, sample) for task, sample in cells if sample.trials]
    each = [sample for _, sample in judged]
    rates = [sample.rate for sample in each if sample.rate is not None]
    single = each[0] if scope.task is not None and each else None
    resolved = variant._replace(form="resolved")
    return SummaryRow(
        contestant=who,
        scope=scope,
        variant=variant,
        tasks=tuple(task for task, _ in judged),
        successes=sum(sample.successes for sample in each),
        trials=sum(sample.trials for sample in each),
        episodes=sum(len(sample.by_episode()) for sample in each),
        errors=sum(sample.errors for _, sample in cells),
        missing=sum(sample.missing for _, sample in cells),
        rate=sum(rates, Fraction(0)) / len(rates) if rates else None,
        interval=shown_interval(single, rng) if single else clustered_interval(each, rng),
        wilson=wilson(single) if single else None,
        gap=None if variant == EXPLICIT else _gap_to(who, EXPLICIT, judged, samples, rng),
        p_holm=None,
        form_gap=(None if variant == resolved else _gap_to(who, resolved, judged, samples, rng)),
    )


def _gap_to(
    who: PolicyRun,
    reference: SettingColumn,
    cells: Sequence[tuple[str, CellResults]],
    samples: Samples,
    rng: np.random.Generator,
) -> Gap | None:
    return measure_gap(
        [
            Pairs.of(sample, samples[who, task, reference])
            for task, sample in cells
            if (who, task, reference) in samples
        ],
        rng,
    )


def _corrected(found: Sequence[SummaryRow]) -> tuple[SummaryRow, ...]:
    """With p-values corrected over what is read together: a policy's tasks, suites, averages."""
    families: dict[tuple[PolicyRun, bool, bool], list[int]] = {}
    for index, one in enumerate(found):
        if one.gap is not None:
            family = (one.contestant, one.scope.task is None, one.scope.suite is None)
            families.setdefault(family, []).append(index)
    corrected = list(found)
    for members in families.values():
        gaps = [found[index].gap for index in members]
        adjusted = holm([gap.p_value for gap in gaps if gap is not None])
        for index, p_value in zip(members, adjusted, strict=True):
            corrected[index] = replace(found[index], p_holm=p_value)
    return tuple(corrected)
