"""Commands of the grounding dataset: ``roboirg export grounding``, ``roboirg score grounding``."""

from __future__ import annotations

import itertools
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from roboirg.cli.export_commands import export_app
from roboirg.cli.options import (
    AnySplit,
    PlanName,
    PlanWords,
    Settings,
    Tasks,
)
from roboirg.core.errors import InvalidValueError
from roboirg.core.plain_text import counted

if TYPE_CHECKING:
    from roboirg.apps.grounding.answer_scores import GroundingScore
    from roboirg.apps.grounding.dataset_export import DatasetFacts
    from roboirg.apps.grounding.items.grounding_item import GroundingItem
    from roboirg.apps.grounding.items.question_set import EpisodeName

COMPARED = 2
"""Files of answers that are compared."""
MIB = 2**20

# Heavy modules are imported inside the commands, so that --help is fast.

score_app = typer.Typer(no_args_is_help=True, help="Score answers of models.")


@score_app.callback()
def _score() -> None:
    # With a callback, a single command keeps its name.
    pass


def export_grounding(
    context: typer.Context,
    out: Annotated[Path, typer.Option(help="Folder for the dataset; empty, or created.")],
    split: AnySplit = "test",
    tasks: Tasks = "all",
    settings: Settings = "all",
    plan: PlanName = None,
) -> None:
    """Export grounding questions with pictures: Parquet and JSON lines.

    A plan may have, under `grounding`: every_variant, frames, frames_every.

    Example: roboirg export grounding --split val --out grounding
    """
    from roboirg.apps.grounding.dataset_export import export_grounding
    from roboirg.apps.grounding.items.question_set import ExportRequest
    from roboirg.cli.progress_bar import progress_bar
    from roboirg.language.generator import check_options
    from roboirg.util.parquet_support import check_parquet_support
    from roboirg.util.processor import worker_count

    check_parquet_support()
    words = PlanWords(context, plan, "grounding", ("every_variant", "frames", "frames_every"))
    options = words.options()
    check_options(options)
    names = words.tasks(tasks, options.wordings)
    request = ExportRequest(
        episodes=_episode_names(words, names, split),
        settings=words.settings(settings, names),
        forms=words.forms(),
        options=options,
        wordings_file=words.fields.get("wordings"),
        **words.choices(ExportRequest),
    )
    with progress_bar("episodes") as progress:
        facts = export_grounding(request, out, worker_count(), progress)
    _print_facts(facts, out)


def _print_facts(facts: DatasetFacts, folder: Path) -> None:
    """Print how large the dataset in a folder is, and its hash."""
    items = counted(facts.items, "item")
    pictures = counted(facts.pictures, "picture")
    videos = counted(facts.videos, "video")
    typer.echo(f"{items}, {pictures}, {videos}, {facts.size / MIB:.1f} MiB: {folder}")
    typer.echo(f"sha256 {facts.sha256}")


def _episode_names(words: PlanWords, tasks: Iterable[str], splits: str) -> tuple[EpisodeName, ...]:
    """Return the names of all episodes to export: task, split and number.

    Args:
        words: the plan, whose splits and episodes count before those of the command line.
        tasks: names of tasks.
        splits: names of splits, separated by commas.
    """
    from roboirg.apps.grounding.items.question_set import EpisodeName
    from roboirg.runs.plan.option_parsing import parse_episodes, parse_splits

    chosen = words.fields.get("episodes", "all")
    found = []
    for task in tasks:
        for split in parse_splits(words.given("split", splits)):
            numbers = parse_episodes(chosen, split, [task])
            found += [EpisodeName(task, split, number) for number in numbers]
    return tuple(found)


@score_app.command("grounding")
def score_grounding(
    data: Annotated[Path, typer.Option(help="Folder of the dataset.")],
    answers: Annotated[
        list[Path] | None,
        typer.Argument(help="Files of answers, each named after its model.", metavar="ANSWERS"),
    ] = None,
    floor: Annotated[
        str | None,
        typer.Option(
            help="Add floors, separated by commas: oracle, chance, command, first-mention, "
            "last-mention, elimination, surface, text-only, or all."
        ),
    ] = None,
    write_floors: Annotated[
        Path | None, typer.Option(help="Folder to write the floors' answers to.")
    ] = None,
    report: Annotated[
        Path | None, typer.Option(help="File for a report in Markdown, with mistakes.")
    ] = None,
) -> None:
    """Score answers to the grounding dataset; two files are also compared.

    Example: roboirg score grounding answers.jsonl --data grounding
    """
    from roboirg.apps.grounding.answer_floors import FLOORS
    from roboirg.apps.grounding.items.grounding_item import read_items
    from roboirg.apps.grounding.score_report import report_text
    from roboirg.cli.names import known_names
    from roboirg.util.atomic_write import write_atomically

    paths = answers or []
    floors = () if floor is None else known_names("floor", floor, FLOORS)
    if not paths and not floors:
        raise InvalidValueError("There is nothing to score; give files of answers or --floor.")
    items = read_items(data)
    scores = _scores_of_files(paths, items)
    comparisons = _comparisons(scores) if len(paths) == COMPARED else []
    for name in floors:
        scores += _floor_scores(name, items, write_floors)
    _print_scores(scores, comparisons)
    if report is not None:
        write_atomically(report, report_text(scores, data, report))
        typer.echo(report)


def _scores_of_files(paths: Iterable[Path], items: Sequence[GroundingItem]) -> list[GroundingScore]:
    """Score files of answers to the items, each named after the model that answered."""
    from roboirg.apps.grounding.answer_scores import score_answers
    from roboirg.apps.grounding.items.answer_file import read_answers

    scores: list[GroundingScore] = []
    for path in paths:
        scores += score_answers(items, read_answers(path, items), path.stem)
    return scores


def _print_scores(scores: Sequence[GroundingScore], comparisons: Iterable[str]) -> None:
    """Print the table of scores, and below it comparisons of models, in sentences."""
    from rich.console import Console

    from roboirg.analysis.tables.rendering.terminal import print_tables
    from roboirg.apps.grounding.score_tables import score_table

    console = Console()
    print_tables([score_table(scores)], console)
    for sentence in comparisons:
        console.print(sentence, highlight=False, markup=False)


def _floor_scores(
    name: str, items: Sequence[GroundingItem], folder: Path | None
) -> tuple[GroundingScore, ...]:
    """Score the answers of a listener without understanding (a floor), such as ``chance``.

    Args:
        name: of the floor.
        items: the questions.
        folder: that the answers are written to, as a file; None to write none.
    """
    from roboirg.apps.grounding.answer_floors import floor_answers
    from roboirg.apps.grounding.answer_scores import score_answers
    from roboirg.apps.grounding.items.answer_file import write_answers

    answers = list(floor_answers(name, items))
    if folder is not None:
        write_answers(folder / f"{name}.jsonl", answers)
    return score_answers(items, answers, name)


def _comparisons(scores: Sequence[GroundingScore]) -> list[str]:
    """Compare two models on the same items, apart for each kind of question; return the sentences.

    Args:
        scores: of both models, one for each kind of question that it answered.
    """
    from roboirg.analysis.measures.comparison import compare
    from roboirg.analysis.measures.comparison_text import sentences

    lines = []
    for first, second in itertools.combinations(scores, 2):
        if first.kind == second.kind:
            result = compare(first.frame, second.frame)
            lines.append("")
            lines += sentences(result, _title(first), _title(second))
    return lines


def _title(score: GroundingScore) -> str:
    """Return a model and its kind of question, for example ``"my-model (slots)"``."""
    return f"{score.name} ({score.kind})"


def add_commands(app: typer.Typer) -> None:
    export_app.command("grounding")(export_grounding)
    app.add_typer(score_app, name="score")
