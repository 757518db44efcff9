"""Command that measures the speed of this machine."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

MINIMUM_WIDTH = 110
"""Columns of output that is not a terminal."""


def bench(
    rounds: Annotated[int, typer.Option(help="Number of repetitions.")] = 5,
    out: Annotated[Path | None, typer.Option(help="JSON file for the results.")] = None,
) -> None:
    """Measure the time and memory of steps, resets and starts on this machine."""
    from rich.console import Console

    from roboirg.perf.bench_runner import results_table, run_measures, write_results
    from roboirg.perf.measures import measures

    console = Console()
    if not console.is_terminal:
        console.width = max(console.width, MINIMUM_WIDTH)
    figures = run_measures(measures(), rounds, lambda words: typer.echo(words, err=True))
    console.print(results_table(figures))
    if out is not None:
        write_results(figures, out)
