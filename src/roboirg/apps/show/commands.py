"""The command that shows an episode: ``roboirg show``."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from roboirg.cli.declared_options import WordsCommand
from roboirg.cli.names import known_settings
from roboirg.cli.options import Settings, Split
from roboirg.core.errors import InvalidValueError

if TYPE_CHECKING:
    from roboirg.core.episode import Episode
    from roboirg.core.instruction_options import InstructionOptions


def show(
    context: typer.Context,
    task: Annotated[str, typer.Argument(help="Name of the task.")],
    episode: Annotated[int, typer.Argument(help="Position in the split, from 0.")],
    split: Split = "test",
    words: Annotated[
        bool, typer.Option("--words", help="Print the instructions only, with their lengths.")
    ] = False,
    settings: Settings = "all",
    out: Annotated[
        str | None,
        typer.Option(
            help="PNG file to write, with a second one for dark pages; TASK-SPLIT-EPISODE.png by "
            "default."
        ),
    ] = None,
) -> None:
    """Print an episode's scene and instructions, and draw what is said and what the oracle does.

    Example: roboirg show PickXtimes 3 --words
    """
    from roboirg.language import settings_of
    from roboirg.language.generator import check_options
    from roboirg.runs.plan.plan_maker import word_options
    from roboirg.tasks import get_task
    from roboirg.tasks.splits.splits import get_episode

    found = get_episode(task, split, episode)
    options = word_options(**context.obj)
    check_options(options)
    task_settings = settings_of(get_task(task))
    chosen = known_settings(settings, [task])
    shown = [setting for setting in chosen if setting in task_settings]
    if words:
        _print_words(found, shown, options)
        return
    if out is None:
        out = f"{task}-{split}-{episode}.png"
    _draw(found, shown, options, Path(out))


def _print_words(episode: Episode, settings: Sequence[str], options: InstructionOptions) -> None:
    """Print what is said in each setting, and how many tokens it needs.

    A setting that cannot express the episode has the reason (the *refusal*) instead. If none can,
    the first one's refusal is raised as an error.
    """
    from roboirg.language.generator import find_refusal, instruct_with
    from roboirg.language.token_counts import tokens_shown

    options_of = {setting: replace(options, setting=setting) for setting in settings}
    refusals = {setting: find_refusal(episode, options_of[setting]) for setting in settings}
    can_be_said = None in refusals.values()
    for setting, refusal in refusals.items():
        title = typer.style(setting, bold=True)
        if refusal is not None and can_be_said:
            typer.echo(f"{title} cannot express the episode: {refusal}")
            continue
        instruction = instruct_with(episode, options_of[setting])  # raises a refusal
        typer.echo(f"{title} ({tokens_shown(instruction.text)} tokens):")
        for utterance in instruction.utterances:
            typer.echo(f"  {utterance.stage:<13} {utterance.text}")


def _draw(
    episode: Episode, settings: Sequence[str], options: InstructionOptions, path: Path
) -> None:
    """Print the scene and the instructions, let the oracle play, and draw what it did.

    What can fail is checked before anything is printed, as playing takes a while. `path` is the PNG
    file; a second one for dark pages is written next to it.
    """
    from rich.console import Console

    from roboirg.analysis.figures.figure_style import check_figure_support
    from roboirg.apps.show.episode_text import print_episode, spoken_settings
    from roboirg.apps.show.playthrough import play_through, write_strip
    from roboirg.envs.factory import check_simulator

    if path.suffix.lower() != ".png" or path.is_dir():
        raise InvalidValueError(f"{str(path)!r} is not a valid picture file; it must end in .png.")
    check_simulator()
    check_figure_support()
    console = Console()
    print_episode(episode, settings, options, console)
    said = spoken_settings(episode, settings, options)
    played = play_through(episode)
    files = write_strip(episode, said, played.moments, path)
    verdict = f"{played.verdict} after {played.steps} steps"
    console.print(f"[bold]oracle:[/] {verdict}", highlight=False)
    for file in files:
        typer.echo(file)


def add_commands(app: typer.Typer) -> None:
    app.command(cls=WordsCommand)(show)
