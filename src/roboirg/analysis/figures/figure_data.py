"""What the figures are drawn from."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from roboirg.analysis.page.entries import in_order
from roboirg.analysis.stats.run_summary import Scope, SummaryRow, summarize
from roboirg.analysis.stats.samples import (
    EvalConditions,
    PolicyRun,
    Samples,
    Versions,
    gather,
    labels,
)
from roboirg.analysis.stats.success_rates import SettingColumn
from roboirg.records.record import Job, Result

SEED = 20_240_607
"""Of the bootstrap; the same records give the same figures."""


@dataclass(frozen=True)
class FigureData:
    """The results of some runs and every figure that follows from them.

    Attributes:
        results: of all runs, each with who they are of.
        samples: the same, sorted.
        summaries: by contestant, scope and telling.
        names: of the contestants, in their order.
    """

    results: tuple[tuple[PolicyRun, Result], ...]
    samples: Samples
    summaries: Mapping[tuple[PolicyRun, Scope, SettingColumn], SummaryRow]
    names: Mapping[PolicyRun, str]

    @classmethod
    def of(
        cls, runs: Sequence[tuple[str, Sequence[Result]]], planned: Sequence[Job] = ()
    ) -> FigureData:
        """Sort and sum up runs, each with its name."""
        samples = gather(runs, planned)
        names = dict(labels(samples))
        policies = list(dict.fromkeys(job.policy for job in planned))
        names = dict(sorted(names.items(), key=lambda item: _place(item[0], policies)))
        samples = in_order(samples, list(names))
        return cls(
            tuple((_who(name, one, names), one) for name, results in runs for one in results),
            samples,
            by_key(samples),
            names,
        )

    def is_complete(self, who: PolicyRun) -> bool:
        """Whether every trial of a contestant's plan has a verdict."""
        return all(one.is_complete for (own, _, _), one in self.summaries.items() if own == who)

    def name(self, who: PolicyRun) -> str:
        """What to call a contestant; marked if something is missing."""
        return self.names[who] + ("" if self.is_complete(who) else " (incomplete)")


def _place(who: PolicyRun, policies: Sequence[str]) -> tuple[object, ...]:
    """As in the plan; by name where there is none."""
    known = who.policy in policies
    rank = policies.index(who.policy) if known else len(policies)
    return (rank, who.policy, who.run, repr(who.rules), repr(who.versions))


def _who(run: str, result: Result, known: Mapping[PolicyRun, str]) -> PolicyRun:
    """Whose a result is; of policies that several runs played, the run's."""
    who = PolicyRun(result.policy, EvalConditions.of(result), Versions.of(result))
    return who if who in known else who._replace(run=run)


def by_key(samples: Samples) -> Mapping[tuple[PolicyRun, Scope, SettingColumn], SummaryRow]:
    """Every figure of some samples, to be looked up."""
    return {
        (one.contestant, one.scope, one.variant): one
        for one in summarize(samples, np.random.default_rng(SEED))
    }
