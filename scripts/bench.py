"""Measure all rows of docs/performance.md: those of `roboirg bench` and ours, with their goals.

python scripts/bench.py --out docs/bench.json
python scripts/write_bench_table.py
"""

from __future__ import annotations

import argparse
import os
import sys
from functools import partial
from pathlib import Path

from benchmarks.goals import all_goals
from benchmarks.results import reaches, update_figures
from rich.console import Console

from roboirg.apps.bench.bench_runner import results_table, run_measures
from roboirg.util.console_width import widen
from roboirg.util.freed_memory import keep_freed_memory


def main() -> None:
    """Measure, print the table, and write the results if a file is given."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--rounds", type=int, default=5, help="number of repetitions")
    parser.add_argument("--only", default="", help="words in the names of the rows to measure")
    parser.add_argument("--out", type=Path, help="JSON file for the results")
    options = parser.parse_args()
    keep_freed_memory()
    load = os.getloadavg()[1]
    goals = [one for one in all_goals() if options.only in one.measure.name]
    if not goals:
        parser.error(f"no row has {options.only!r} in its name")
    measures = [one.measure for one in goals]
    results = run_measures(measures, options.rounds, partial(print, file=sys.stderr))
    console, table = Console(), results_table(results)
    widen(console, table)
    console.print(table)
    for goal, result in zip(goals, results, strict=True):
        if not reaches(result, goal.least):
            print(f"{result.name}, {result.against or 'at most'}: misses its goal {goal.least:g}")
    if options.out is not None:
        update_figures(options.out, goals, results, load)


if __name__ == "__main__":
    main()
