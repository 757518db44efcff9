"""Success and gap to explicit for each kind of instruction."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from roboirg.evaluation.analysis.stats.breakdowns import Labels, cells_by_label
from roboirg.evaluation.analysis.stats.cells import (
    Cells,
    PolicyRun,
    cell_interval,
    clustered_interval,
)
from roboirg.evaluation.analysis.stats.intervals import SEED, Interval
from roboirg.evaluation.analysis.stats.option_labels import REFERENCE, options_sort_key
from roboirg.evaluation.analysis.stats.paired_tests import Gap, measure_gap, with_holm
from roboirg.evaluation.analysis.stats.run_summary import ALL, ScopeResults, group_by_scope


@dataclass(frozen=True, slots=True)
class BreakdownRow:
    """The results of one policy run with one set of options on instructions of one label.

    Attributes:
        label: of the instructions.
        results: the mean over the tasks that have such instructions.
        interval: of the rate.
        gap: to the explicit setting on the same episodes; None if none of them was played.
        p_holm: its p-value after Holm's correction over all rows of the policy run.
    """

    label: str
    results: ScopeResults
    interval: Interval | None
    gap: Gap | None
    p_holm: float | None = None

    @property
    def policy_run(self) -> PolicyRun:
        return self.results.policy_run


def break_down(cells: Cells, labels: Labels) -> tuple[BreakdownRow, ...]:
    """Return a row for each policy run, set of options and label, in the order of the cells.

    Gaps are paired by episode: those of a label are compared with explicit on the very same
    episodes, whose instruction has the same label or none. The cells are sorted and have the
    explicit setting.
    """
    explicit = {key: cell for key, cell in cells.items() if key.options == REFERENCE}
    found = []
    for label, part in cells_by_label(cells, labels).items():
        has_explicit = any(key.options == REFERENCE for key in part)
        found += [
            (label, one)
            for one in group_by_scope(part if has_explicit else {**explicit, **part})
            if one.scope == ALL and (has_explicit or one.options != REFERENCE)
        ]
    runs = list(dict.fromkeys(key.policy_run for key in cells))
    # Stable: the labels of a setting stay in their order.
    found.sort(key=lambda pair: (runs.index(pair[1].policy_run), options_sort_key(pair[1].options)))
    rng = np.random.default_rng(SEED)
    return with_holm([_row(label, one, rng) for label, one in found], lambda row: row.policy_run)


def _row(label: str, results: ScopeResults, rng: np.random.Generator) -> BreakdownRow:
    judged = list(results.cells.values())
    return BreakdownRow(
        label,
        results,
        # The order of these two is part of the results: they draw from one generator.
        cell_interval(judged[0], rng) if len(judged) == 1 else clustered_interval(judged, rng),
        measure_gap(results.explicit_pairs(), rng),
    )
