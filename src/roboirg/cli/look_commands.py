"""Commands that list the tasks and check the machine."""

from __future__ import annotations

from functools import partial
from pathlib import Path
from typing import Annotated

import typer

from roboirg.core.field_types import MOST_SECONDS


def doctor(
    render: Annotated[
        int,
        typer.Option(
            min=0,
            max=MOST_SECONDS,
            help="Seconds to draw pictures; a driver may draw one and hang only later.",
        ),
    ] = 0,
) -> None:
    """Check whether episodes can be played on this machine, and show what is missing.

    Example: roboirg doctor --render 600
    """
    from roboirg.cli.doctor import run_doctor

    raise typer.Exit(run_doctor(render))


def fetch_models(
    wheel: Annotated[
        str | None, typer.Option(help="ManiSkill's wheel on this machine; downloaded by default.")
    ] = None,
) -> None:
    """Put the model files of the robot and the table in place, if they are not; print where.

    Example: roboirg fetch-models
    """
    from roboirg.simulation.model_fetch import fetch_model_files

    file = None
    if wheel:
        file = Path(wheel)
    typer.echo(fetch_model_files(file, partial(typer.echo, err=True)))


def list_tasks() -> None:
    """List the tasks with their suites and settings.

    Example: roboirg tasks
    """
    from roboirg.language import settings_of
    from roboirg.tasks import every_task

    for task in every_task().values():
        typer.echo(f"{task.name:<16} {task.suite:<12} {', '.join(settings_of(task))}")
