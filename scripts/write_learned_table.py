"""Write the table of docs/learned-policy.md from the pack that holds its episodes.

python scripts/write_learned_table.py
"""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np

from roboirg.apps.leaderboard.packing import opened_run
from roboirg.apps.learning.policy.paper_experiment import row_of
from roboirg.evaluation.analysis.stats.cells import CellResults, gather
from roboirg.evaluation.analysis.stats.chance import silent_chance
from roboirg.evaluation.analysis.stats.intervals import wilson_interval
from roboirg.evaluation.analysis.stats.paired_tests import Pairs, holm, sign_flip_test
from roboirg.evaluation.records.store import read_results
from roboirg.tasks import all_tasks

ROOT = Path(__file__).parent.parent
PAGE = ROOT / "docs" / "learned-policy.md"
PACK = ROOT / "results" / "learned-policy-val.roboirg.zip"
TABLE = re.compile(r"(?<=<!-- learned -->\n\n).*?(?=\n\n<!-- end of learned -->)", re.DOTALL)
SMALLEST_P = 0.001
"""Smaller ones are not printed."""
MEMORY, WITHOUT = "small-recurrent", "small-none"


def played() -> Mapping[tuple[str, str], CellResults]:
    """Return the episodes of the pack, by row and task."""
    with opened_run(PACK) as run:
        cells = gather([("val", read_results(run))])
    return {(row_of(key.policy_run.policy)[0], key.task): cell for key, cell in cells.items()}


def table() -> str:
    """Return the table: success by task with memory and without, and the paired test."""
    cells = played()
    tasks = [task for task in all_tasks() if (MEMORY, task) in cells]
    pairs = {task: Pairs.of(cells[MEMORY, task], cells[WITHOUT, task]) for task in tasks}
    p_values = holm([sign_flip_test(one.differences) for one in pairs.values()])
    lines = [
        "| task | `recurrent` | `none` | only one of them | p (Holm) | a blind guess |",
        "| --- | ---: | ---: | ---: | ---: | ---: |",
    ]
    for (task, one), p_value in zip(pairs.items(), p_values, strict=True):
        first, second = (_rate(cells[row, task]) for row in (MEMORY, WITHOUT))
        alone = f"{one.overlap.only_first} : {one.overlap.only_second}"
        episodes = sorted({trial.episode for trial in cells[MEMORY, task].verdicts})
        guess = np.mean([silent_chance(task, "val", episode) for episode in episodes])
        shown = "< 0.001" if p_value < SMALLEST_P else f"{p_value:.3f}"
        lines.append(f"| {task} | {first} | {second} | {alone} | {shown} | {100 * guess:.0f} |")
    sums = [_sum([cells[row, task] for task in tasks]) for row in (MEMORY, WITHOUT)]
    return "\n".join([*lines, f"| all | {sums[0]} | {sums[1]} | | | |"])


def _sum(cells: Sequence[CellResults]) -> str:
    successes, trials = sum(one.successes for one in cells), sum(one.trials for one in cells)
    return f"{successes:,} of {trials:,} ({successes / trials:.0%})"


def _rate(cell: CellResults) -> str:
    low, high = wilson_interval(cell.successes, cell.trials)
    return f"{100 * cell.successes / cell.trials:.0f} ({100 * low:.0f} to {100 * high:.0f})"


def page_text() -> str:
    """Return the page with the table of the pack."""
    return TABLE.sub(lambda _: table(), PAGE.read_text(encoding="utf-8"), count=1)


if __name__ == "__main__":
    PAGE.write_text(page_text(), encoding="utf-8")
