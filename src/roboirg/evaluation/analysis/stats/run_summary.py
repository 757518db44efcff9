"""Summary of results: each policy and option set on each task, each suite and all tasks.

`group_by_scope` only counts, which is all that the terminal table needs; `summarize` adds
intervals and tests, which need SciPy.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from fractions import Fraction
from typing import NamedTuple

import numpy as np

from roboirg.core.instruction_options import InstructionOptions
from roboirg.evaluation.analysis.stats.cells import (
    CellKey,
    CellResults,
    Cells,
    PolicyRun,
    cell_interval,
    clustered_interval,
)
from roboirg.evaluation.analysis.stats.intervals import SEED, Interval
from roboirg.evaluation.analysis.stats.option_labels import REFERENCE
from roboirg.evaluation.analysis.stats.paired_tests import (
    Gap,
    Overlap,
    Pairs,
    measure_gap,
    pooled_overlap,
    with_holm,
)
from roboirg.tasks import all_tasks


class Scope(NamedTuple):
    """The tasks that a row of a summary covers: one task, a suite, or all tasks (both None)."""

    task: str | None = None
    suite: str | None = None


ALL = Scope()
ALL_TASKS = "all tasks"
"""Label of `ALL`."""


class ScopeKey(NamedTuple):
    """Policy run, scope and instruction options of a row."""

    policy_run: PolicyRun
    scope: Scope
    options: InstructionOptions


@dataclass(frozen=True, slots=True)
class ScopeResults:
    """The results of one policy run in one scope with one set of options.

    Attributes:
        key: policy run, scope and options.
        cells: by task.
        explicit: results of the same tasks in the explicit setting, by task.
        resolved: results of the same tasks in the resolved form, by task.
    """

    key: ScopeKey
    cells: Mapping[str, CellResults]
    explicit: Mapping[str, CellResults]
    resolved: Mapping[str, CellResults]

    @property
    def policy_run(self) -> PolicyRun:
        return self.key.policy_run

    @property
    def scope(self) -> Scope:
        """The tasks that are covered."""
        return self.key.scope

    @property
    def options(self) -> InstructionOptions:
        return self.key.options

    @property
    def tasks(self) -> tuple[str, ...]:
        """Tasks with a verdict."""
        return tuple(task for task, cell in self.cells.items() if cell.trials)

    @property
    def successes(self) -> int:
        """Number of trials that succeeded."""
        return sum(cell.successes for cell in self.cells.values())

    @property
    def trials(self) -> int:
        """Number of trials with a verdict."""
        return sum(cell.trials for cell in self.cells.values())

    @property
    def episodes(self) -> int:
        """Number of episodes with a verdict."""
        return sum(len(cell.by_episode()) for cell in self.cells.values())

    @property
    def errors(self) -> int:
        """Number of trials that ended in an error."""
        return sum(cell.errors for cell in self.cells.values())

    @property
    def missing(self) -> int:
        """Number of planned trials without a result."""
        return sum(cell.missing for cell in self.cells.values())

    @property
    def is_complete(self) -> bool:
        """Whether every planned trial has a verdict."""
        return self.trials > 0 and not self.errors and not self.missing

    @property
    def rate(self) -> Fraction | None:
        """Unweighted mean of the tasks' success rates; None without a verdict."""
        rates = [cell.rate for cell in self.cells.values() if cell.rate is not None]
        return sum(rates, Fraction(0)) / len(rates) if rates else None

    @property
    def pooled_rate(self) -> Fraction | None:
        """Successes by trials, whatever their task; None without a verdict."""
        return Fraction(self.successes, self.trials) if self.trials else None

    def explicit_pairs(self) -> list[Pairs]:
        """Pair each task with its explicit setting."""
        return _pairs(self.cells, self.explicit)

    def resolved_pairs(self) -> list[Pairs]:
        """Pair each task with its resolved form."""
        return _pairs(self.cells, self.resolved)

    def explicit_overlap(self) -> Overlap:
        """Return the outcomes of all trials that also have a verdict in the explicit setting."""
        return pooled_overlap(self.explicit_pairs())


@dataclass(frozen=True, slots=True)
class SummaryRow(ScopeResults):
    """Results with their statistics.

    Attributes:
        interval: of the rate: of a task with one policy seed Wilson's, else the bootstrap's.
        gap: to the explicit setting on the same episodes; None for explicit itself or without
            pairs.
        p_holm: its p-value after Holm's correction over all cells of the policy run, or over all
            its suites, or over all its averages.
        form_gap: the implicit form less the resolved one on the same episodes; None for resolved
            itself or without pairs.
    """

    interval: Interval | None
    gap: Gap | None
    form_gap: Gap | None
    p_holm: float | None = None


def group_by_scope(cells: Cells) -> tuple[ScopeResults, ...]:
    """Group cells by scope, in the order of the cells: tasks, then suites, then all tasks."""
    suites = {task.name: task.suite for task in all_tasks().values()}
    levels: tuple[dict[ScopeKey, dict[str, CellResults]], ...] = ({}, {}, {})
    for (policy_run, task, options), cell in cells.items():
        scopes = (Scope(task=task), Scope(suite=suites.get(task, "")), ALL)
        for level, scope in zip(levels, scopes, strict=True):
            if scope != Scope(suite=""):
                level.setdefault(ScopeKey(policy_run, scope, options), {})[task] = cell
    return tuple(
        ScopeResults(
            key,
            grouped,
            _references(cells, key, grouped, REFERENCE),
            _references(cells, key, grouped, replace(key.options, form="resolved")),
        )
        for level in levels
        for key, grouped in level.items()
    )


def summarize(cells: Cells) -> tuple[SummaryRow, ...]:
    """Group cells by scope and add intervals, gaps and corrected p-values."""
    rng = np.random.default_rng(SEED)
    rows = [_with_statistics(one, rng) for one in group_by_scope(cells)]
    # What is read together: a policy run's tasks, suites, averages.
    return with_holm(
        rows, lambda one: (one.policy_run, one.scope.task is None, one.scope.suite is None)
    )


def _references(
    cells: Cells, key: ScopeKey, tasks: Mapping[str, CellResults], options: InstructionOptions
) -> dict[str, CellResults]:
    """Return the results of the same tasks with other options; none for the options themselves."""
    if options == key.options:
        return {}
    keys = {task: CellKey(key.policy_run, task, options) for task in tasks}
    return {task: cells[other] for task, other in keys.items() if other in cells}


def _pairs(cells: Mapping[str, CellResults], references: Mapping[str, CellResults]) -> list[Pairs]:
    return [
        Pairs.of(cell, references[task])
        for task, cell in cells.items()
        if cell.trials and task in references
    ]


def _with_statistics(results: ScopeResults, rng: np.random.Generator) -> SummaryRow:
    judged = [cell for cell in results.cells.values() if cell.trials]
    is_single = results.scope.task is not None and judged
    return SummaryRow(
        key=results.key,
        cells=results.cells,
        explicit=results.explicit,
        resolved=results.resolved,
        # The order of these three is part of the results: they draw from one generator.
        interval=cell_interval(judged[0], rng) if is_single else clustered_interval(judged, rng),
        gap=measure_gap(results.explicit_pairs(), rng),
        form_gap=measure_gap(results.resolved_pairs(), rng),
    )
