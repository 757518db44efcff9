"""The results of some runs with what is measured of them: what figures and tables are made from."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from functools import cached_property

from roboirg.analysis.measures.measure import Summaries, summarize
from roboirg.analysis.results.frame import Frame
from roboirg.analysis.results.policy_run import PolicyRun
from roboirg.analysis.results.run_cells import Cells, cells_of
from roboirg.records.record import Record


@dataclass(frozen=True)
class RunData:
    """The results of some runs; what is measured of them is measured when it is asked for.

    Attributes:
        frame: the results.
        records: all whole records of the runs, for those who need more than results; they are read
            from the disk when they are asked for, once.
    """

    frame: Frame
    records: Iterable[Record] = ()

    @cached_property
    def cells(self) -> Cells:
        return cells_of(self.frame)

    @cached_property
    def summaries(self) -> Summaries:
        """What `summarize` measures, by policy run, scope and options."""
        return summarize(self.cells)

    @cached_property
    def without_control_arms(self) -> RunData:
        """The data without control arms, if there is any."""
        frame = self.frame.without_control_arms()
        return self if frame is self.frame else RunData(frame, self.records)

    def name(self, policy_run: PolicyRun) -> str:
        """Return a policy run's label, or ``pi0 (incomplete)`` if planned trials have no verdict.

        These ended in an error or were not played.
        """
        label = self.frame.names[policy_run]
        if policy_run.is_until_decided:
            return label
        for key, cell in self.cells.items():
            if key.policy_run == policy_run and not cell.counts.is_complete:
                return f"{label} (incomplete)"
        return label
