"""The command that draws an episode: ``roboirg show``."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from roboirg.cli.options import (
    Split,
)
from roboirg.core.errors import InvalidValueError


def show(
    task: Annotated[str, typer.Argument(help="Name of the task.")],
    episode: Annotated[int, typer.Argument(help="Position in the split, from 0.")],
    split: Split = "test",
    out: Annotated[
        str | None, typer.Option(help="PNG file to write; TASK-SPLIT-EPISODE.png by default.")
    ] = None,
) -> None:
    """Print an episode's scene and instructions, and draw how the oracle plays it."""
    from rich.console import Console

    from roboirg.apps.show.episode_text import print_episode
    from roboirg.apps.show.playthrough import draw_sheet
    from roboirg.envs.factory import check_simulator
    from roboirg.tasks.splits.splits import get_episode

    found = get_episode(task, split, episode)
    path = Path(f"{task}-{split}-{episode}.png" if out is None else out)
    if path.suffix.lower() != ".png" or path.is_dir():
        raise InvalidValueError(f"{str(path)!r} is not a valid picture file; it must end in .png.")
    check_simulator()
    console = Console()
    print_episode(found, console)
    verdict = draw_sheet(found, path)
    console.print(f"[bold]the oracle[/] {verdict}", highlight=False)
    typer.echo(path)


def add_commands(app: typer.Typer) -> None:
    app.command()(show)
