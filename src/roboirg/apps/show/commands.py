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
    from roboirg.evaluation.plan.plan_maker import word_options
    from roboirg.language import settings_of
    from roboirg.language.generator import check_options
    from roboirg.tasks import get_task
    from roboirg.tasks.splits.splits import get_episode

    found = get_episode(task, split, episode)
    options = word_options(**context.obj)
    check_options(options)
    possible = settings_of(get_task(task))
    chosen = known_settings(settings)
    shown = [name for name in chosen if name in possible] or chosen
    if words:
        _print_words(found, shown, options)
    else:
        path = Path(f"{task}-{split}-{episode}.png" if out is None else out)
        _draw(found, shown, options, path)


def _print_words(episode: Episode, settings: Sequence[str], options: InstructionOptions) -> None:
    """Print what is said in each setting, and how many tokens it needs."""
    from roboirg.language.generator import find_refusal, instruct_with
    from roboirg.language.token_counts import tokens_shown

    told = {name: replace(options, setting=name) for name in settings}
    refusals = {name: find_refusal(episode, one) for name, one in told.items()}
    for name, chosen in told.items():
        refusal = refusals[name]
        # Where nothing can be said, the first refusal is an error.
        if refusal is not None and None in refusals.values():
            typer.echo(f"{typer.style(name, bold=True)} cannot express the episode: {refusal}")
            continue
        instruction = instruct_with(episode, chosen)
        length = tokens_shown(instruction.text)
        typer.echo(f"{typer.style(name, bold=True)} ({length} tokens):")
        for utterance in instruction.utterances:
            typer.echo(f"  {utterance.stage:<13} {utterance.text}")


def _draw(
    episode: Episode, settings: Sequence[str], options: InstructionOptions, path: Path
) -> None:
    """Print the scene and the instructions, and draw the oracle's episode."""
    from rich.console import Console

    from roboirg.apps.show.episode_strip import SpokenSetting
    from roboirg.apps.show.episode_text import print_episode
    from roboirg.apps.show.playthrough import write_strip
    from roboirg.envs.factory import check_simulator
    from roboirg.evaluation.analysis.figures.figure_style import check_figure_support
    from roboirg.language.generator import find_refusal, instruct_with
    from roboirg.language.settings import all_settings

    if path.suffix.lower() != ".png" or path.is_dir():
        raise InvalidValueError(f"{str(path)!r} is not a valid picture file; it must end in .png.")
    check_simulator()
    check_figure_support()
    console = Console()
    print_episode(episode, settings, options, console)
    told = {name: replace(options, setting=name) for name in settings}
    said = [
        SpokenSetting(name, instruct_with(episode, one).text, all_settings()[name].color)
        for name, one in told.items()
        if not find_refusal(episode, one)
    ]
    verdict, paths = write_strip(episode, said, path)
    console.print(f"[bold]oracle:[/] {verdict}", highlight=False)
    for one in paths:
        typer.echo(one)


def add_commands(app: typer.Typer) -> None:
    app.command(cls=WordsCommand)(show)
