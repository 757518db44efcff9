"""The cells of runs: one for each policy run, task and instruction options."""

from __future__ import annotations

from collections.abc import Mapping
from typing import NamedTuple

from roboirg.analysis.results.policy_run import PolicyRun
from roboirg.core.instruction_options import InstructionOptions
from roboirg.stats.cells import Cell, Columns, gather


class CellKey(NamedTuple):
    """Policy run, task and instruction options of a cell."""

    policy_run: PolicyRun
    task: str
    options: InstructionOptions


Cells = Mapping[CellKey, Cell]
"""The results of runs."""


def cells_of(frame: Columns) -> Cells:
    """Gather the trials of each policy run in each task with each set of options, as one cell."""
    cells = {}
    for values, by_task in gather(frame, ("run", "task", "options")).items():
        key = CellKey(*values)
        cells[key] = by_task[key.task]
    return cells
