"""Commands for instructions: ``roboirg language`` and ``roboirg export``."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from roboirg.cli.export_commands import export_app
from roboirg.cli.names import known_settings, known_tasks
from roboirg.cli.options import (
    AnySplit,
    PlanName,
    PlanWords,
    Settings,
    Tasks,
    check_output_file,
)
from roboirg.core.errors import InvalidValueError, RoboIRGError, known_name
from roboirg.core.plain_text import counted

if TYPE_CHECKING:
    from rich.console import RenderableType

# Heavy modules are imported inside the commands, so that --help is fast.

MOST_FAILURES = 10
"""Most broken rules to print."""

language_app = typer.Typer(no_args_is_help=True, help="Count, validate and score the instructions.")


def export_instructions(
    context: typer.Context,
    out: Annotated[Path, typer.Option(help="File to write; its name ends in .jsonl or .parquet.")],
    split: AnySplit = "test",
    tasks: Tasks = "all",
    settings: Settings = "all",
    plan: PlanName = None,
) -> None:
    """Export a row per episode, setting and form (columns: see docs/instruction-data.md).

    Example: roboirg export instructions --split val --out words.parquet
    """
    from roboirg.apps.language_lab.instruction_export import (
        EXPORT_FORMATS,
        check_export_support,
        encode,
    )
    from roboirg.evaluation.plan.option_parsing import parse_splits
    from roboirg.language import FORMS
    from roboirg.language.instruction_row import row
    from roboirg.language.variants import instructions
    from roboirg.tasks.splits.splits import split_episodes
    from roboirg.util.atomic_write import write_atomically

    check_output_file(out)
    kind = known_name("format", out.suffix.removeprefix("."), EXPORT_FORMATS)
    check_export_support(kind)
    words = PlanWords(context, plan)
    options = words.options()
    names = words.tasks(tasks, options.wordings)
    chosen = words.settings(settings)
    episodes = list(split_episodes(names, parse_splits(words.given("split", split))))
    said = instructions(episodes, chosen, words.forms(FORMS), options)
    rows = [row(episode, instruction) for episode, instruction in said]
    if not rows:
        raise InvalidValueError(f"None of these tasks has the setting {', '.join(chosen)}.")
    write_atomically(out, encode(rows, kind))
    typer.echo(f"{counted(len(rows), 'instruction')} of {counted(len(episodes), 'episode')}: {out}")


@language_app.command()
def stats(
    split: AnySplit = "test",
    tasks: Tasks = "all",
) -> None:
    """Count words, referring expressions, patterns, relations and landmarks.

    Example: roboirg language stats --split val
    """
    from roboirg.apps.language_lab.statistics_tables import overview_tables
    from roboirg.evaluation.plan.option_parsing import parse_splits
    from roboirg.language import plain_settings
    from roboirg.language.variants import instructions
    from roboirg.tasks.splits.splits import split_episodes

    episodes = split_episodes(known_tasks(tasks), parse_splits(split))
    said = [one for _, one in instructions(episodes, plain_settings(), ("implicit",))]
    _print(*overview_tables(said))


@language_app.command("validate")
def validate_instructions(
    seeds: Annotated[
        int, typer.Option(help="Random scenes for each task, beyond the splits.")
    ] = 100,
    tasks: Tasks = "all",
    split: Annotated[str, typer.Option(help="train, val, test, all or none.")] = "all",
) -> None:
    """Read all instructions back and check their rules; exit code 2 if one is broken.

    Example: roboirg language validate --seeds 10
    """
    from roboirg.apps.language_lab.validation.episode_checks import check_place, places_of
    from roboirg.apps.language_lab.validation.validation_results import ValidationResults
    from roboirg.apps.language_lab.validation.validation_tables import validation_tables
    from roboirg.cli.progress_bar import progress_bars
    from roboirg.evaluation.plan.option_parsing import parse_splits
    from roboirg.util.parallel_map import parallel_map
    from roboirg.util.processor import worker_count

    names = known_tasks(tasks)
    wanted = () if split.strip().lower() == "none" else parse_splits(split)
    places, found = places_of(names, wanted, seeds), ValidationResults()
    with progress_bars() as show:
        for done, (_, results) in enumerate(parallel_map(check_place, places, worker_count()), 1):
            found.add(results)
            show("episodes", done, len(places), "")
    for table in validation_tables(found):
        _print(table, "")
    for failure in found.failures[:MOST_FAILURES]:
        where = f"{failure.episode}, seed {failure.seed}, {failure.setting}"
        typer.echo(f"{failure.rule}: {where}: {failure.words}")
    if found.failures:
        texts = found.texts.total()
        broken = counted(len(found.failures), "broken rule")
        raise RoboIRGError(f"Found {broken} in {counted(texts, 'text')}.")


@language_app.command("shortcuts")
def score_shortcuts(
    context: typer.Context,
    split: Annotated[str, typer.Option(help="train, val, test, all or none.")] = "test",
    seeds: Annotated[int, typer.Option(help="Random scenes for each task, beyond the split.")] = 0,
    tasks: Tasks = "all",
    settings: Settings = "all",
    plan: PlanName = None,
    by: Annotated[
        str | None, typer.Option(help="A row for each pattern, task or slot of a setting.")
    ] = None,
    learned: Annotated[
        bool, typer.Option(help="Add learners that see only words or only scenes (takes minutes).")
    ] = False,
) -> None:
    """Score rules and learners that see only words or only scenes: what needs no understanding.

    Example: roboirg language shortcuts --settings reasoning --by pattern
    """
    from roboirg.evaluation.plan.option_parsing import parse_splits
    from roboirg.shortcuts.goal_learner import check_learning_support
    from roboirg.shortcuts.shortcut_tables import (
        GROUPINGS,
        JUDGING_SPLIT,
        LEARNING_SCENES,
        TRAINING_SPLIT,
        shortcut_rows,
        shortcut_table,
    )

    words = PlanWords(context, plan)
    split = words.given("split", split)
    splits = () if split.strip().lower() == "none" else parse_splits(split)
    grouping = None if by is None else known_name("row", by, GROUPINGS)
    if learned:
        check_learning_support()
        if not {TRAINING_SPLIT, JUDGING_SPLIT}.isdisjoint(splits):
            raise InvalidValueError(
                f"--learned trains on the splits {TRAINING_SPLIT} and {JUDGING_SPLIT}, so --split "
                f"{split} would test it on what it has seen; choose --split test."
            )
    options = replace(words.options(), form=words.form())
    names = words.tasks(tasks, options.wordings)
    chosen = words.settings(settings)
    scenes = LEARNING_SCENES if learned else None
    rows = shortcut_rows(names, splits, chosen, options, seeds=seeds, by=grouping, learning=scenes)
    if not rows:
        raise InvalidValueError(
            f"There is nothing to score: no episode of {', '.join(names)} in {', '.join(chosen)}."
        )
    source = [*splits, *([f"{seeds:,} random scenes per task"] if seeds else [])]
    title = f"Shortcuts, {options.form} form, {' and '.join(source)}"
    _print(shortcut_table(rows, title, grouping))


@language_app.command("check-scenarios")
def check_scenario_file(
    path: Annotated[Path, typer.Argument(help="File of scenarios, commands or sentences, TOML.")],
    scenario: Annotated[str | None, typer.Option(help="Check this one only, by its frame.")] = None,
    seeds: Annotated[
        int, typer.Option(min=0, help="Random scenes for each scenario, beyond the splits.")
    ] = 200,
) -> None:
    """Check the words of a file in each task that it serves, and print texts of them.

    The exit code is 2 if a rule breaks.

    Example: roboirg language check-scenarios mine.toml --scenario "school trip"
    """
    from roboirg.apps.language_lab.scenarios.explicit_check import (
        check_explicit,
        has_explicit_words,
    )
    from roboirg.apps.language_lab.scenarios.scenario_check import (
        check_scenarios,
        scenes_of,
        unserved_settings,
    )
    from roboirg.apps.language_lab.scenarios.scenario_report import explicit_lines, report_lines
    from roboirg.language.scenarios.wording_file import read_words

    wordings = read_words(path)
    if scenario is not None:
        frames: set[str] = set()
        for words in wordings.tasks.values():
            frames.update(written.fields.frame for written in words.scenarios)
        known_name("scenario", scenario, sorted(frames))
    if not wordings.name:
        typer.echo(
            f"{path.name} has no name, so it is a file of scenarios for the benchmark; to use it "
            'with --wordings, begin it with a line such as name = "mine".\n'
        )
    broken = 0
    for task, words in wordings.tasks.items():
        if scenario is None and has_explicit_words(words, task):
            explicit = check_explicit(words, scenes_of(task, 0))
            typer.echo("\n".join(explicit_lines(explicit, task)))
            broken += len(explicit.broken)
        scenes = scenes_of(task, seeds)
        reports = check_scenarios(words, scenario, scenes)
        for report in reports:
            typer.echo("\n".join(report_lines(report, task)))
            broken += len(report.broken)
        for complaint in unserved_settings(reports, scenes) if scenario is None else ():
            typer.echo(f"BROKEN {task}: {complaint}.\n")
            broken += 1
    if broken:
        raise RoboIRGError(f"Found {counted(broken, 'broken rule')} in {path.name}.")


@language_app.command("sample")
def sample_texts(
    out: Annotated[Path, typer.Option(help="Folder for the sheets and their key.")],
    tasks: Tasks = "all",
    settings: Settings = "all",
    anchors: Annotated[int, typer.Option(min=0, help="Texts of language 3 among them.")] = 20,
    seed: Annotated[int, typer.Option(min=0, help="Other scenes for each seed, from 0.")] = 0,
) -> None:
    """Write sheets of 44 texts a setting of language 4 to be rated blind, 1 to 5, and their key.

    Example: roboirg language sample --out rating --tasks PickXtimes,StopCube
    """
    from roboirg.apps.language_lab.scenarios.rating_sample import RATERS, draw_sample, key, sheet
    from roboirg.util.atomic_write import write_atomically

    texts = draw_sample(known_tasks(tasks), known_settings(settings), anchors, seed)
    if not texts:
        raise InvalidValueError(f"Language 4 has no words for {tasks} in {settings}.")
    for rater in RATERS:
        write_atomically(out / f"sheet-{rater}.csv", sheet(texts, rater))
    write_atomically(out / "key.csv", key(texts))
    typer.echo(f"{counted(len(texts), 'text')} on {len(RATERS)} sheets: {out}")


def _print(*parts: RenderableType) -> None:
    """Print tables, which are neither cut nor folded in a file."""
    from rich.console import Console

    from roboirg.util.console_width import widen

    console = Console()
    widen(console, *parts)
    for part in parts:
        console.print(part)


@language_app.command("import-robomme")
def import_robomme(
    path: Annotated[Path, typer.Argument(help="Folder of a clone of RoboMME's repository.")],
    out: Annotated[Path, typer.Option(help="Wording file to write, TOML.")],
    name: Annotated[str, typer.Option(help="Name of the wordings, for records.")] = "robomme",
) -> None:
    """Make a wording file of RoboMME's sentences, for explicit; implicit settings say our words.

    Example: roboirg language import-robomme robomme --out robomme.toml
    """
    from roboirg.apps.language_lab.robomme_import import import_robomme as make_wordings
    from roboirg.util.atomic_write import write_atomically

    check_output_file(out)
    text, wordings = make_wordings(path, name)
    write_atomically(out, text)
    for task, found in wordings.tasks.items():
        typer.echo(f"{task}: {counted(len(found.literals), 'sentence')}")
    typer.echo(f"Wrote {wordings.identity}: {out}")


def add_commands(app: typer.Typer) -> None:
    export_app.command("instructions")(export_instructions)
    app.add_typer(language_app, name="language")
