"""``roboirg export``: the group of commands that write data for other programs."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from roboirg.cli.options import AnySplit, Tasks, check_output_file
from roboirg.core.plain_text import counted

export_app = typer.Typer(no_args_is_help=True, help="Export data for other programs.")


@export_app.command("episodes")
def export_episodes(
    out: Annotated[Path, typer.Option(help="File to write, JSON lines.")],
    split: AnySplit = "test",
    tasks: Tasks = "all",
) -> None:
    """Export a line per episode: objects, motions, video and goal (keys: see docs/robomme.md).

    Example: roboirg export episodes --split val --out episodes.jsonl
    """
    from roboirg.runs.plan.option_parsing import parse_names, parse_splits
    from roboirg.tasks import find_tasks
    from roboirg.tasks.splits.episode_export import write_episodes
    from roboirg.tasks.splits.splits import split_episodes

    check_output_file(out)
    names = find_tasks(parse_names("task", tasks))
    episodes = split_episodes(names, parse_splits(split))
    typer.echo(f"Wrote {counted(write_episodes(episodes, out), 'episode')} to {out}.")
