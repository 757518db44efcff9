"""``roboirg records``: the group of commands that bring the records of runs together."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from roboirg.cli.options import check_output_file
from roboirg.cli.run_commands import Folder, folder_of
from roboirg.core.plain_text import counted

records_app = typer.Typer(no_args_is_help=True, help="Merge and export records.")


@records_app.command()
def merge(
    runs: Annotated[list[str], typer.Argument(help="Output folders of runs.")],
    out: Annotated[str, typer.Option(help="Folder for all their records and videos.")],
) -> None:
    """Merge the records and videos of several runs into one folder.

    Example: roboirg records merge runs/first runs/second --out runs/all
    """
    from roboirg.evaluation.records.merging import merge_runs

    merged = merge_runs([folder_of(run) for run in runs], folder_of(out))
    typer.echo(
        f"Added {counted(merged.added, 'record')} to {out}; {merged.duplicates:,} already there."
    )
    if merged.conflicts:
        first = merged.conflicts[0]
        typer.echo(
            f"The verdicts of {counted(len(merged.conflicts), 'episode')} differ between runs; "
            f"kept the first verdict of each. For example, not kept: {first.slug}: "
            f"{first.outcome}.",
            err=True,
        )


@records_app.command()
def export(
    run: Folder,
    out: Annotated[Path, typer.Option(help="Parquet file to write.")],
) -> None:
    """Export the records of a run as a Parquet table (columns: see docs/record.md).

    Example: roboirg records export runs/first --out first.parquet
    """
    from roboirg.evaluation.records.parquet import write_parquet
    from roboirg.evaluation.records.record_codec import read_summary
    from roboirg.evaluation.records.store import StoredRun
    from roboirg.util.parquet_support import check_parquet_support

    check_parquet_support()
    check_output_file(out)
    stored = StoredRun(folder_of(run), read_summary)
    count = write_parquet(stored.records(stored.newest), out)
    typer.echo(f"{counted(count, 'record')}: {out}")
