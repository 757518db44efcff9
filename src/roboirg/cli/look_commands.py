"""Commands that show tasks and words, and check the machine."""

from __future__ import annotations

from functools import partial
from pathlib import Path
from typing import Annotated

import typer

from roboirg.cli.options import (
    Distractor,
    Frame,
    Reasoning,
    Rival,
    Split,
    Stages,
    Wordings,
)
from roboirg.core.plain_text import counted


def doctor() -> None:
    """Check whether episodes can be played on this machine, and show what is missing."""
    from roboirg.cli.doctor import run_doctor

    raise typer.Exit(run_doctor())


def fetch_models(
    wheel: Annotated[
        str | None, typer.Option(help="ManiSkill's wheel on this machine; downloaded by default.")
    ] = None,
) -> None:
    """Put the model files of the robot and the table in place, if they are not; print where."""
    from roboirg.simulation.model_fetch import fetch_model_files

    typer.echo(fetch_model_files(Path(wheel) if wheel else None, partial(typer.echo, err=True)))


def list_tasks() -> None:
    """List the tasks with their suites and settings."""
    from roboirg.language import settings_of
    from roboirg.tasks import every_task

    for task in every_task().values():
        typer.echo(f"{task.name:<16} {task.suite:<12} {', '.join(settings_of(task))}")


def instruct(
    task: Annotated[str, typer.Argument(help="Name of the task.")],
    episode: Annotated[int, typer.Argument(help="Position in the split, from 0.")],
    setting: Annotated[
        str, typer.Option(help="Setting, or all (listed by roboirg tasks).")
    ] = "all",
    form: Annotated[str, typer.Option(help="implicit or resolved.")] = "implicit",
    split: Split = "test",
    stages: Stages = "1-5",
    distractor: Distractor = "neutral",
    distractors: Annotated[int, typer.Option(help="Number of distractors.")] = 1,
    frame: Frame = "robot",
    rival: Rival = "none",
    reasoning: Reasoning = "plain",
    wordings: Wordings = None,
) -> None:
    """Print the instructions of an episode, and how many tokens they need."""
    from roboirg.evaluation.plan.plan_parsing import means_all, parse_stages
    from roboirg.language import instruct as make_instruction
    from roboirg.language import settings_of
    from roboirg.language.token_counts import count_tokens
    from roboirg.language.wordings.wording_store import open_wordings
    from roboirg.tasks import get_task
    from roboirg.tasks.splits.splits import get_episode

    spoken, identity = parse_stages(stages), open_wordings(wordings)
    found = get_episode(task, split, episode)
    for name in settings_of(get_task(task)) if means_all(setting) else (setting,):
        instruction = make_instruction(
            found,
            name,
            form,
            stages=spoken,
            distractor=distractor,
            distractors=distractors,
            frame=frame,
            rival=rival,
            reasoning=reasoning,
            wordings=identity,
        )
        length = counted(count_tokens(instruction.text), "token")
        typer.echo(f"{typer.style(name, bold=True)} ({length}):")
        for utterance in instruction.utterances:
            typer.echo(f"  {utterance.stage:<13} {utterance.text}")
