"""The command that measures this machine."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

MINIMUM_WIDTH = 110
"""Columns to use where the output is not a terminal."""


def bench(
    rounds: Annotated[int, typer.Option(help="How often everything is measured.")] = 5,
    out: Annotated[Path | None, typer.Option(help="A JSON file for all figures.")] = None,
) -> None:
    """Time steps, resets, starts and memory against the floor and the stock path."""
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
