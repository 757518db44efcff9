"""``roboirg records``: the group of commands that bring the records of runs together."""

from __future__ import annotations

from typing import Annotated

import typer

from roboirg.core.plain_text import counted

records_app = typer.Typer(no_args_is_help=True, help="Merge records.")


@records_app.command()
def merge(
    runs: Annotated[list[str], typer.Argument(help="Output folders of runs.")],
    out: Annotated[str, typer.Option(help="Folder for all their records and videos.")],
) -> None:
    """Merge the records and videos of several runs into one folder.

    Example: roboirg records merge runs/first runs/second --out runs/all
    """
    from roboirg.records.merging import merge_runs
    from roboirg.records.run_files import run_folder

    merged = merge_runs([run_folder(run) for run in runs], run_folder(out))
    typer.echo(
        f"Added {counted(merged.added, 'record')} to {out}; {merged.duplicates:,} already there."
    )
    for sentence in merged.warnings():
        typer.echo(sentence, err=True)
    if merged.conflicts:
        first = merged.conflicts[0]
        typer.echo(
            f"The verdicts of {counted(len(merged.conflicts), 'episode')} differ between runs; "
            f"kept the first verdict of each. For example, not kept: {first.slug}: "
            f"{first.outcome}.",
            err=True,
        )
