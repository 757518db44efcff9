"""Commands of the listener that learns: ``roboirg learn``."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from roboirg.cli.options import Settings, Tasks, Workers, check_output_file
from roboirg.util.plurals import counted

# Heavy modules are imported inside the commands, so that --help is fast.

learn_app = typer.Typer(no_args_is_help=True, help="Train a listener, and let it answer.")


@learn_app.command("listener")
def learn_listener(
    out: Annotated[Path, typer.Option(help="File for what it has learned.")],
    tasks: Tasks = "all",
    settings: Settings = "all",
    words: Annotated[str, typer.Option(help="Pool of words: train or test.")] = "train",
    scenes: Annotated[
        int, typer.Option(min=0, help="Random scenes of each task beyond the train split.")
    ] = 0,
    detector_epochs: Annotated[int, typer.Option(min=1, help="Passes over the pictures.")] = 6,
    reader_epochs: Annotated[int, typer.Option(min=1, help="Passes over the instructions.")] = 30,
    without: Annotated[
        str, typer.Option(help="What it does not get: none, pictures or words.")
    ] = "none",
    seed: Annotated[int, typer.Option(help="Of initial weights and order.")] = 0,
    workers: Workers = None,
) -> None:
    """Train a listener on the train split: pictures with free labels, then instructions."""
    from roboirg.cli.language_commands import known_name, known_settings, known_tasks
    from roboirg.core.word_pools import POOLS
    from roboirg.evaluation.executors.executor import core_count
    from roboirg.policies.learned.learned_listener import check_learn_support

    check_learn_support()
    from roboirg.policies.learned.learned_model import WITHOUTS, save_model
    from roboirg.policies.learned.listener_training import TrainingPlan, train_listener

    check_output_file(out)
    plan = TrainingPlan(
        known_tasks(tasks),
        known_settings(settings),
        known_name("pool of words", words, POOLS),
        scenes,
        detector_epochs,
        reader_epochs,
        known_name("variant", without, WITHOUTS),
        seed,
    )
    count = core_count() if workers is None else workers
    shown: dict[str, int] = {}

    def progress(stage: str, done: int, total: int) -> None:
        tenth = 10 * done // total
        if shown.get(stage) != tenth:
            shown[stage] = tenth
            typer.echo(f"{stage}: {done} of {total}", err=True)

    save_model(train_listener(plan, count, progress), out)
    typer.echo(f"{out}, {out.stat().st_size / 2**20:.1f} MiB")


@learn_app.command("answers")
def learned_answers(
    model: Annotated[Path, typer.Argument(help="What was learned.", metavar="PATH")],
    data: Annotated[Path, typer.Option(help="Folder of a grounding dataset.")],
    out: Annotated[Path, typer.Option(help="File for the answers.")],
) -> None:
    """Let a trained listener answer the grounding dataset, for roboirg score grounding."""
    from roboirg.evaluation.grounding_set.answer_file import write_answers
    from roboirg.evaluation.grounding_set.grounding_item import read_items
    from roboirg.evaluation.grounding_set.learned_answers import learned_answers as answers_of
    from roboirg.policies.learned.learned_listener import check_learn_support

    check_learn_support()
    from roboirg.policies.learned.learned_model import load_model

    items, learned = read_items(data), load_model(model)
    write_answers(out, answers_of(learned, items, data))
    typer.echo(f"{counted(len(items), 'answer')}: {out}")
