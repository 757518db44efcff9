"""Commands of the grounding dataset: ``roboirg export grounding``, ``roboirg score grounding``."""

from __future__ import annotations

from collections.abc import Sequence
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
    from roboirg.cli.progress_bar import progress_bar
    from roboirg.evaluation.grounding_items.question_set import (
        ExportRequest,
    )
    from roboirg.evaluation.plan.option_parsing import parse_episodes, parse_splits
    from roboirg.language.generator import check_options
    from roboirg.util.parquet_support import check_parquet_support
    from roboirg.util.processor import worker_count

    check_parquet_support()
    words = PlanWords(context, plan, "grounding", ("every_variant", "frames", "frames_every"))
    options = words.options()
    check_options(options)
    request = ExportRequest(
        episodes=tuple(
            (task, one, index)
            for task in words.tasks(tasks, options.wordings)
            for one in parse_splits(words.given("split", split))
            for index in parse_episodes(words.fields.get("episodes", "all"), one, [task])
        ),
        settings=words.settings(settings),
        forms=words.forms(),
        options=options,
        wordings_file=words.fields.get("wordings"),
        **words.choices(ExportRequest),
    )
    count = worker_count()
    with progress_bar("episodes") as progress:
        facts = export_grounding(request, out, count, progress)
    typer.echo(
        f"{counted(facts.items, 'item')}, {counted(facts.pictures, 'picture')}, "
        f"{counted(facts.videos, 'video')}, {facts.size / 2**20:.1f} MiB: {out}\n"
        f"sha256 {facts.sha256}"
    )


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
        Path | None, typer.Option(help="File for a report in Markdown, with confusions.")
    ] = None,
) -> None:
    """Score answers to the grounding dataset; two files are also compared.

    Example: roboirg score grounding answers.jsonl --data grounding
    """
    from rich.console import Console

    from roboirg.apps.grounding.answer_floors import FLOORS, floor_answers
    from roboirg.apps.grounding.answer_scores import score_answers
    from roboirg.apps.grounding.score_report import report_text
    from roboirg.apps.grounding.score_tables import score_table
    from roboirg.cli.names import known_names
    from roboirg.evaluation.analysis.tables.rendering.terminal import print_tables
    from roboirg.evaluation.grounding_items.answer_file import read_answers, write_answers
    from roboirg.evaluation.grounding_items.grounding_item import read_items
    from roboirg.util.atomic_write import write_atomically

    names = () if floor is None else known_names("floor", floor, FLOORS)
    if not answers and not names:
        raise InvalidValueError("There is nothing to score; give files of answers or --floor.")
    items = read_items(data)
    scores = [
        one
        for path in answers or ()
        for one in score_answers(items, read_answers(path, items), path.stem)
    ]
    compared = _comparisons(scores) if len(answers or ()) == 2 else []  # noqa: PLR2004
    for name in names:
        found = list(floor_answers(name, items))
        if write_floors is not None:
            write_answers(write_floors / f"{name}.jsonl", found)
        scores += score_answers(items, found, name)
    console = Console()
    print_tables([score_table(scores)], console)
    for sentence in compared:
        console.print(sentence, highlight=False, markup=False)
    if report is not None:
        write_atomically(report, report_text(scores, data, report))
        typer.echo(report)


def _comparisons(scores: Sequence[GroundingScore]) -> list[str]:
    """Return the paired comparison of two models in each kind of question that both answered."""
    from roboirg.evaluation.analysis.stats.comparison import compare
    from roboirg.evaluation.analysis.stats.comparison_text import sentences

    found: list[str] = []
    for place, first in enumerate(scores):
        for second in scores[place + 1 :]:
            if first.kind == second.kind:
                names = f"{first.name} ({first.kind})", f"{second.name} ({second.kind})"
                result = compare(first.frame, second.frame)
                found += ["", *sentences(result, *names)]
    return found


def add_commands(app: typer.Typer) -> None:
    export_app.command("grounding")(export_grounding)
    app.add_typer(score_app, name="score")
