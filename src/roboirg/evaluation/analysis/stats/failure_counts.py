"""How the episodes of cells failed."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping

from roboirg.evaluation.analysis.stats.cells import CellKey
from roboirg.evaluation.analysis.stats.run_data import RunData
from roboirg.judging.failure_attribution import EXECUTION, GROUNDING

UNATTRIBUTED = "not attributed"
FAILURES: tuple[str, ...] = (*GROUNDING, *EXECUTION, UNATTRIBUTED)
"""The names of failures, those of grounding first."""


def count_failures(data: RunData) -> Mapping[CellKey, Counter[str]]:
    """Return the number of failures of each name for every cell with a verdict, in order."""
    found = {key: Counter[str]() for key, cell in data.cells.items() if cell.trials}
    for policy_run, result in data.results:
        if result.outcome == "failure":
            name = UNATTRIBUTED if result.attribution is None else result.attribution.failure
            found[CellKey(policy_run, result.task, result.column)][name] += 1
    return found
