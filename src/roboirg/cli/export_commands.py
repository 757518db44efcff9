"""``roboirg export``: the group of commands that write data for other programs."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from roboirg.cli.options import AnySplit, Tasks, check_output_file
from roboirg.cli.run_commands import Folder, folder_of
from roboirg.core.plain_text import counted

export_app = typer.Typer(no_args_is_help=True, help="Export data for other programs.")


@export_app.callback()
def _export() -> None:
    # With a callback, a single command keeps its name.
    pass


def export_episodes(
    out: Annotated[Path, typer.Option(help="File to write, JSON lines.")],
    split: AnySplit = "test",
    tasks: Tasks = "all",
) -> None:
    """Export a line per episode: objects, motions, video and goal (keys: see docs/tasks.md)."""
    from roboirg.evaluation.plan.plan_parsing import parse_names, parse_splits
    from roboirg.tasks import find_tasks
    from roboirg.tasks.splits.episode_export import write_episodes
    from roboirg.tasks.splits.splits import split_episodes

    check_output_file(out)
    names = find_tasks(parse_names("task", tasks))
    episodes = split_episodes(names, parse_splits(split))
    typer.echo(f"Wrote {counted(write_episodes(episodes, out), 'episode')} to {out}.")


def export_records(
    run: Folder,
    out: Annotated[Path, typer.Option(help="Parquet file to write.")],
) -> None:
    """Export the records of a run as a Parquet table (columns: see docs/running.md)."""
    from roboirg.evaluation.records.parquet import write_parquet
    from roboirg.evaluation.records.record_codec import read_index_entry
    from roboirg.evaluation.records.store import StoredRun
    from roboirg.util.parquet_support import check_parquet_support

    check_parquet_support()
    check_output_file(out)
    stored = StoredRun(folder_of(run), read_index_entry)
    count = write_parquet(stored.records(stored.newest), out)
    typer.echo(f"{counted(count, 'record')}: {out}")
