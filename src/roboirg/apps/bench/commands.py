"""Command that measures the speed of this machine."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Annotated

import typer


def bench(
    rounds: Annotated[int, typer.Option(help="Number of repetitions.")] = 5,
    out: Annotated[Path | None, typer.Option(help="JSON file for the results.")] = None,
) -> None:
    """Measure the time and memory of steps, resets and starts on this machine.

    Example: roboirg bench --out bench.json
    """
    from rich.console import Console

    from roboirg.apps.bench.bench_runner import results_table, run_measures, write_results
    from roboirg.apps.bench.measures import measures
    from roboirg.util.console_width import widen
    from roboirg.util.freed_memory import keep_freed_memory

    keep_freed_memory()
    load = os.getloadavg()[1]
    figures = run_measures(measures(), rounds, lambda words: typer.echo(words, err=True))
    console, table = Console(), results_table(figures)
    widen(console, table)
    console.print(table)
    if out is not None:
        write_results(figures, out, load)


def add_commands(app: typer.Typer) -> None:
    app.command()(bench)
