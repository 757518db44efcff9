"""How episodes ended, as rates of all of them, and of what a gap to explicit consists.

A share among failures conditions on failing: it may rise because other failures became fewer, and
its difference between two settings is not one of the same episodes. Rates of all episodes are.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping
from fractions import Fraction
from typing import NamedTuple

from roboirg.analysis.measures.measure import (
    ScopeKey,
    ScopeSummary,
    Summaries,
    mean_rate,
    summarize,
)
from roboirg.analysis.measures.run_data import RunData
from roboirg.analysis.results.frame import as_column
from roboirg.analysis.results.run_cells import cells_of
from roboirg.core.failures import FAILURE_KINDS, FailureKind
from roboirg.stats.cells import ByTask


class EndRates(NamedTuple):
    """How episodes ended: the rate of successes and those of `FAILURE_KINDS`."""

    success: ScopeSummary
    grounding: ScopeSummary
    execution: ScopeSummary
    undecided: ScopeSummary


class ShareBounds(NamedTuple):
    """The least and the most that a share can be."""

    least: Fraction
    most: Fraction


def measure_ends(data: RunData, scopes: Collection[str]) -> Mapping[ScopeKey, EndRates]:
    """Measure the rates of success and of each kind of failure: grounding, execution, undecided.

    All are rates of the episodes with a verdict, so they add up to 1, and their gaps to explicit
    instructions (which name the goal) to 0. A failure without a known cause is undecided.

    Args:
        data: of the runs.
        scopes: what is measured: names of tasks or suites, or `ALL_TASKS`.
    """
    rates_of_kinds = [_measure_failures(data, kind, scopes) for kind in FAILURE_KINDS]
    ends = {}
    for key, success in data.summaries.items():
        if key.scope in scopes and success.tasks:
            ends[key] = EndRates(success, *(rates[key] for rates in rates_of_kinds))
    return ends


def _measure_failures(data: RunData, kind: FailureKind, scopes: Collection[str]) -> Summaries:
    """Measure how often episodes ended in a kind of failure, such as grounding.

    To measure this as success is measured, episodes with this failure count as successes and all
    others with a verdict as failures. Errors and missing episodes stay what they are.
    """
    frame = data.frame
    outcomes = []
    for outcome, failure_kind in zip(frame["outcome"], frame["failure_kind"], strict=True):
        counted_as = outcome
        if outcome == "success":
            counted_as = "failure"
        elif outcome == "failure" and (failure_kind or "undecided") == kind:
            counted_as = "success"
        outcomes.append(counted_as)
    recounted = frame.extended({"outcome": as_column(outcomes)})
    return summarize(cells_of(recounted), scopes)


def grounding_share(grounding: ByTask, execution: ByTask, undecided: ByTask) -> ShareBounds | None:
    """Return which share of the failures was due to grounding, not to execution, within bounds.

    The least share takes all undecided failures for execution, the most takes them for grounding.
    None without failures.

    Args:
        grounding: the episodes by task, in which a failure of grounding counts as success.
        execution: the same episodes, in which one of execution does.
        undecided: the same episodes, in which one that is undecided does.
    """
    grounding_rate = mean_rate(grounding) or Fraction(0)
    execution_rate = mean_rate(execution) or Fraction(0)
    undecided_rate = mean_rate(undecided) or Fraction(0)
    failed = grounding_rate + execution_rate + undecided_rate
    if not failed:
        return None
    return ShareBounds(grounding_rate / failed, (grounding_rate + undecided_rate) / failed)
