"""How the episodes of cells failed."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping

from roboirg.evaluation.analysis.stats.cells import CellKey
from roboirg.evaluation.analysis.stats.run_data import RunData
from roboirg.evaluation.records.record import Summary
from roboirg.judging.failure_attribution import EXECUTION, GROUNDING

UNATTRIBUTED = "not attributed"
FAILURES: tuple[str, ...] = (*GROUNDING, *EXECUTION, UNATTRIBUTED)
"""The names of failures, those of grounding first."""


def failure_name(result: Summary) -> str:
    """Return the name of a result's failure."""
    return UNATTRIBUTED if result.attribution is None else result.attribution.failure


def count_failures(data: RunData) -> Mapping[CellKey, Counter[str]]:
    """Return the number of failures of each name for every cell with a verdict, in order."""
    found = {key: Counter[str]() for key, cell in data.cells.items() if cell.trials}
    for policy_run, result in data.results:
        if result.outcome == "failure":
            found[CellKey(policy_run, result.task, result.column)][failure_name(result)] += 1
    return found
