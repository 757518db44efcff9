"""Commands for instructions: ``roboirg language`` and ``roboirg export``."""

from __future__ import annotations

from collections.abc import Sequence
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

    from roboirg.language.scenarios.scenario import TaskScenarios

# Heavy modules are imported inside the commands, so that --help is fast.

language_app = typer.Typer(no_args_is_help=True, help="Count, check and score the instructions.")


def export_instructions(
    context: typer.Context,
    out: Annotated[Path, typer.Option(help="File to write; its name ends in .jsonl or .parquet.")],
    split: AnySplit = "test",
    tasks: Tasks = "all",
    settings: Settings = "all",
    plan: PlanName = None,
) -> None:
    """Export a row per episode, setting and form (columns: see docs/grounding.md).

    Example: roboirg export instructions --split val --out words.parquet
    """
    from roboirg.apps.language_lab.instruction_export import encode, format_of, rows_of
    from roboirg.language import FORMS
    from roboirg.runs.plan.option_parsing import parse_splits
    from roboirg.tasks.splits.splits import split_episodes
    from roboirg.util.atomic_write import write_atomically

    check_output_file(out)
    kind = format_of(out)
    words = PlanWords(context, plan)
    options = words.options()
    names = words.tasks(tasks, options.wordings)
    chosen = words.settings(settings, names)
    episodes = list(split_episodes(names, parse_splits(words.given("split", split))))
    rows = rows_of(episodes, chosen, words.forms(FORMS), options)
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
    from roboirg.language import plain_settings
    from roboirg.language.variants import instructions
    from roboirg.runs.plan.option_parsing import parse_splits
    from roboirg.tasks.splits.splits import split_episodes

    episodes = split_episodes(known_tasks(tasks), parse_splits(split))
    said = [
        instruction for _, instruction in instructions(episodes, plain_settings(), ("implicit",))
    ]
    _print(*overview_tables(said))


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
    from roboirg.shortcuts.shortcut_tables import GROUPINGS, shortcut_rows, shortcut_table

    # What is not given here stands in the plan, if one is named.
    words = PlanWords(context, plan)
    split = words.given("split", split)
    splits = _scored_splits(split)
    grouping = None
    if by is not None:
        grouping = known_name("row", by, GROUPINGS)
    scenes = None
    if learned:
        scenes = _scenes_to_learn_from(split, splits)
    options = replace(words.options(), form=words.form())
    names = words.tasks(tasks, options.wordings)
    chosen = words.settings(settings, names)
    rows = shortcut_rows(names, splits, chosen, options, seeds=seeds, by=grouping, learning=scenes)
    if not rows:
        raise InvalidValueError(
            f"There is nothing to score: no episode of {', '.join(names)} in {', '.join(chosen)}."
        )
    _print(shortcut_table(rows, _title(options.form, splits, seeds), grouping))


def _scored_splits(split: str) -> Sequence[str]:
    """Return the splits for the text of an option: ``all`` gives all, ``none`` none."""
    from roboirg.runs.plan.option_parsing import parse_splits

    return () if split.strip().lower() == "none" else parse_splits(split)


def _title(form: str, splits: Sequence[str], seeds: int) -> str:
    """Return the title of a table: ``Shortcuts, implicit form, test and 200 random scenes …``.

    Args:
        form: of the instructions.
        splits: names of those whose scenes are scored.
        seeds: number of random scenes for each task; 0 for none.
    """
    sources = list(splits)
    if seeds:
        sources.append(f"{seeds:,} random scenes per task")
    return f"Shortcuts, {form} form, {' and '.join(sources)}"


def _scenes_to_learn_from(split: str, splits: Sequence[str]) -> int:
    """Return how many random scenes of each task learners learn from.

    Raises if scikit-learn is missing, or learners would be tested on what they learn from.

    Args:
        split: what was typed, for the error.
        splits: that it stands for.
    """
    from roboirg.shortcuts.goal_learner import check_learning_support
    from roboirg.shortcuts.shortcut_tables import JUDGING_SPLIT, LEARNING_SCENES, TRAINING_SPLIT

    check_learning_support()
    if TRAINING_SPLIT in splits or JUDGING_SPLIT in splits:
        raise InvalidValueError(
            f"--learned trains on the splits {TRAINING_SPLIT} and {JUDGING_SPLIT}, so --split "
            f"{split} would test it on what it has seen; choose --split test."
        )
    return LEARNING_SCENES


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
    from roboirg.language.scenarios.wording_file import read_words

    wordings = read_words(path)
    if scenario is not None:  # then it must be one of the file
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
        if scenario is None:
            broken += _check_explicit(words, task)
        broken += _check_scenarios(words, task, scenario, seeds, path)
    if broken:
        raise RoboIRGError(f"Found {counted(broken, 'broken rule')} in {path.name}.")


def _check_explicit(words: TaskScenarios, task: str) -> int:
    """Check what a file says in the explicit setting, and print a report.

    Args:
        words: what the file says for the task.
        task: its name.

    Returns:
        How many rules the words break; 0 if the file has no explicit words of its own.
    """
    from roboirg.apps.language_lab.scenarios.explicit_check import (
        check_explicit,
        has_explicit_words,
    )
    from roboirg.apps.language_lab.scenarios.scenario_check import scenes_of
    from roboirg.apps.language_lab.scenarios.scenario_report import explicit_lines

    if not has_explicit_words(words, task):
        return 0
    report = check_explicit(words, scenes_of(task, 0))
    typer.echo("\n".join(explicit_lines(report, task)))
    return len(report.broken)


def _check_scenarios(
    words: TaskScenarios, task: str, frame: str | None, seeds: int, path: Path
) -> int:
    """Check the scenarios of a file for a task, print a report on each, and count broken rules.

    Args:
        words: of the task.
        task: its name.
        frame: of the only scenario to check; None for all, which then must serve every scene.
        seeds: number of random scenes.
        path: of the file.
    """
    from roboirg.apps.language_lab.scenarios.scenario_check import (
        check_scenarios,
        scenes_of,
        unserved_settings,
    )
    from roboirg.apps.language_lab.scenarios.scenario_report import report_lines

    scenes = scenes_of(task, seeds)
    reports = check_scenarios(words, frame, scenes)
    broken = 0
    for report in reports:
        typer.echo("\n".join(report_lines(report, task)))
        broken += len(report.broken)
    if frame is None:
        for complaint in unserved_settings(reports, scenes, path):
            typer.echo(f"BROKEN {task}: {complaint}.\n")
            broken += 1
    return broken


@language_app.command("sample")
def sample_texts(
    out: Annotated[Path, typer.Option(help="Folder for the sheets and their key.")],
    tasks: Tasks = "all",
    settings: Settings = "all",
    seed: Annotated[int, typer.Option(min=0, help="Other scenes for each seed, from 0.")] = 0,
) -> None:
    """Write sheets of 44 texts a setting to be rated blind, 1 to 5, and their key.

    Example: roboirg language sample --out rating --tasks PickXtimes,StopCube
    """
    from roboirg.apps.language_lab.scenarios.rating_sample import RATERS, draw_sample, key, sheet
    from roboirg.util.atomic_write import write_atomically

    names = known_tasks(tasks)
    texts = draw_sample(names, known_settings(settings, names), seed)
    if not texts:
        raise InvalidValueError(f"There are no words of {tasks} in {settings}.")
    for rater in RATERS:
        write_atomically(out / f"sheet-{rater}.csv", sheet(texts, rater))
    write_atomically(out / "key.csv", key(texts))
    typer.echo(f"{counted(len(texts), 'text')} on {len(RATERS)} sheets: {out}")


def _print(*parts: RenderableType) -> None:
    """Print tables; where the output is a file, they are as wide as they need and not folded."""
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
    """Add the commands of this app to ``roboirg``."""
    export_app.command("instructions")(export_instructions)
    app.add_typer(language_app, name="language")
