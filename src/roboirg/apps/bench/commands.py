"""Command that measures the speed of this machine."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Annotated

import typer


def bench(
    rounds: Annotated[int, typer.Option(help="Number of repetitions.")] = 5,
    out: Annotated[
        Path | None, typer.Option(help="New JSON file for the results of all rounds.")
    ] = None,
) -> None:
    """Measure the time of steps, resets and starts, and the pace of workers, on this machine.

    Example: roboirg bench --out bench.json
    """
    from rich.console import Console

    from roboirg.apps.bench import bench_runner
    from roboirg.apps.bench.measures import measures
    from roboirg.core.errors import InvalidValueError
    from roboirg.util.console_width import widen
    from roboirg.util.freed_memory import keep_freed_memory

    if out is not None and (out.exists() or not out.parent.is_dir()):
        why = "exists" if out.exists() else "is not in an existing folder"
        raise InvalidValueError(f"{str(out)!r} {why}; --out must name a new file.")
    keep_freed_memory()
    where = bench_runner.circumstances(load=os.getloadavg()[1])
    results = bench_runner.run_measures(
        measures(), rounds, lambda words: typer.echo(words, err=True)
    )
    console, table = Console(), bench_runner.results_table(results)
    widen(console, table)
    console.print(table)
    if out is not None:
        bench_runner.write_json([{**one.as_json(), **where} for one in results], out)


def add_commands(app: typer.Typer) -> None:
    app.command()(bench)
