"""Measure the rows of docs/performance.md, each against its goal.

python scripts/bench.py --out docs/bench.json
python scripts/write_bench_table.py
"""

from __future__ import annotations

import argparse
import sys
from functools import partial
from pathlib import Path

from benchmarks.measures import all_measures
from benchmarks.results import markdown_table, reaches, run_measures, update_figures

from roboirg.util.freed_memory import keep_freed_memory


def main() -> None:
    """Measure, print the table, and write the results if a file is given."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--rounds", type=int, default=5, help="number of repetitions")
    parser.add_argument("--only", default="", help="words in the names of the rows to measure")
    parser.add_argument("--out", type=Path, help="JSON file for the results")
    options = parser.parse_args()
    keep_freed_memory()
    measures = [measure for measure in all_measures() if options.only in measure.name]
    if not measures or options.rounds < 1:
        parser.error(f"no row has {options.only!r} in its name, or there is no round")
    rows = run_measures(measures, options.rounds, partial(print, file=sys.stderr))
    print(markdown_table(rows), end="")
    for row in rows:
        if not reaches(row):
            print(f"{row['name']}, {row['against'] or 'at most'}: misses its goal {row['goal']:g}")
    if options.out is not None:
        update_figures(options.out, rows)


if __name__ == "__main__":
    main()
