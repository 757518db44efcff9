"""Commands for episodes: ``roboirg export episodes``."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from roboirg.cli.options import AnySplit, Tasks
from roboirg.core.errors import InvalidValueError
from roboirg.util.plurals import counted


def export_episodes(
    out: Annotated[Path, typer.Option(help="File to write, JSON lines.")],
    split: AnySplit = "test",
    tasks: Tasks = "all",
) -> None:
    """Export a line per episode: objects, motions, video and goal (keys: see docs/tasks.md)."""
    from roboirg.core.episode import SPLITS
    from roboirg.episodes.episode_export import write_episodes
    from roboirg.episodes.splits import check_split
    from roboirg.evaluation.plan_parsing import means_all, parse_names
    from roboirg.language.variants import split_episodes
    from roboirg.tasks import find_tasks

    if out.is_dir() or not out.parent.is_dir():
        raise InvalidValueError(f"{str(out)!r} is not a file in an existing folder.")
    splits = SPLITS if means_all(split) else (check_split(split),)
    names = find_tasks(parse_names("task", tasks))
    episodes = (one for name in names for each in splits for one in split_episodes(name, each))
    typer.echo(f"Wrote {counted(write_episodes(episodes, out), 'episode')} to {out}.")
