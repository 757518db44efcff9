"""The results of some runs with their summary: what figures and tables of runs are made from."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from roboirg.evaluation.analysis.stats.cells import (
    Cells,
    PolicyRun,
    gather,
    labels,
    only_told,
    policy_order,
    sort_cells,
)
from roboirg.evaluation.analysis.stats.run_summary import ScopeKey, SummaryRow, summarize
from roboirg.evaluation.records.record import Job, Summary


@dataclass(frozen=True)
class RunData:
    """The results of some runs and their summary.

    Attributes:
        results: of all runs, each with its policy run.
        cells: the results gathered into cells, in order.
        summaries: by policy run, scope and options.
        names: labels of the policy runs, in order.
    """

    results: tuple[tuple[PolicyRun, Summary], ...]
    cells: Cells
    summaries: Mapping[ScopeKey, SummaryRow]
    names: Mapping[PolicyRun, str]

    @classmethod
    def of(
        cls, runs: Sequence[tuple[str, Sequence[Summary]]], planned: Sequence[Job] = ()
    ) -> RunData:
        """Gather, sort and summarize runs, each with its name.

        Policies have the order of the plan, or are sorted by name without one.
        """
        found = gather(runs, planned)
        policies = list(dict.fromkeys(job.policy for job in planned))
        cells = sort_cells(found, policy_order(found, policies))
        names = labels(cells)
        results = [(_owner(name, one, names), one) for name, results in runs for one in results]
        return cls(tuple(results), cells, summaries_by_key(cells), names)

    def told(self) -> RunData:
        """Return the data without control arms, if there is any."""
        cells = only_told(self.cells)
        names = labels(cells)
        results = tuple(one for one in self.results if one[0] in names)
        summaries = {key: one for key, one in self.summaries.items() if key.policy_run in names}
        return RunData(results, cells, summaries, names)

    def owner(self, run: str, result: Summary) -> PolicyRun:
        return _owner(run, result, self.names)

    def is_complete(self, policy_run: PolicyRun) -> bool:
        """Return whether every planned trial of a policy run has a verdict."""
        return all(
            one.is_complete for key, one in self.summaries.items() if key.policy_run == policy_run
        )

    def name(self, policy_run: PolicyRun) -> str:
        """Return the label of a policy run, marked if it is incomplete."""
        return self.names[policy_run] + ("" if self.is_complete(policy_run) else " (incomplete)")


def summaries_by_key(cells: Cells) -> Mapping[ScopeKey, SummaryRow]:
    """Summarize cells for look-up by key."""
    return {one.key: one for one in summarize(cells)}


def _owner(run: str, result: Summary, known: Mapping[PolicyRun, str]) -> PolicyRun:
    """Return the policy run of a result; it names the run if several runs played the policy."""
    policy_run = PolicyRun.of(result)
    return policy_run if policy_run in known else policy_run._replace(run=run)
