"""Measure the rows of docs/performance.md, each against its goal.

python scripts/bench.py --out docs/bench.json
python scripts/write_bench_table.py
"""

from __future__ import annotations

import sys
from functools import partial
from pathlib import Path

import typer
from benchmarks.measures import all_measures
from benchmarks.results import markdown_table, reaches, run_measures, update_figures

from roboirg.util.freed_memory import keep_freed_memory


def main(rounds: int = 5, only: str = "", out: Path | None = None) -> None:
    """Measure, print the table, and write the results if a file is given.

    Args:
        rounds: number of repetitions.
        only: words in the names of the rows to measure.
        out: JSON file for the results.
    """
    keep_freed_memory()
    measures = [measure for measure in all_measures() if only in measure.name]
    if not measures or rounds < 1:
        raise typer.BadParameter(f"no row has {only!r} in its name, or there is no round")
    rows = run_measures(measures, rounds, partial(print, file=sys.stderr))
    print(markdown_table(rows), end="")
    for row in rows:
        if not reaches(row):
            print(f"{row['name']}, {row['against'] or 'at most'}: misses its goal {row['goal']:g}")
    if out is not None:
        update_figures(out, rows)


if __name__ == "__main__":
    typer.run(main)
