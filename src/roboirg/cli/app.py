"""The ``roboirg`` command: parses, calls, prints.

Exit codes: 0 all went well; 2 something was asked for that cannot be, or episodes ended in
errors (one sentence on stderr); 130 stopped by Ctrl-C, 143 by SIGTERM.
"""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Annotated

import typer

import roboirg
from roboirg.cli import language_commands, policy_commands, report_commands, run_commands
from roboirg.cli.bench_commands import bench
from roboirg.cli.options import Distractor, Frame, Split, Stages, Tasks, Video, Workers
from roboirg.cli.real_commands import real_app
from roboirg.cli.run_commands import INTERRUPTED, USAGE_ERROR, Out
from roboirg.core.errors import InvalidValueError, RoboIRGError

# Everything heavy is imported inside the commands, so that --help answers at once.

# The base of all that typer raises about the command line has moved between its versions.
_WrongUsage: type[Exception] = next(
    kind
    for kind in typer.BadParameter.__mro__
    if kind.__name__ == "ClickException" and issubclass(kind, Exception)
)
_MAX_MESSAGE_LENGTH = 300

DEMO_POLICIES = ("oracle", "listener", "forgetful")

app = typer.Typer(
    name="roboirg",
    help="RoboIRGBench: does a robot policy understand people who do not spell everything out?",
    no_args_is_help=True,
    add_completion=False,
    pretty_exceptions_enable=False,
    context_settings={"help_option_names": ["-h", "--help"]},
)

app.add_typer(language_commands.language_app, name="language")
app.add_typer(language_commands.export_app, name="export")
app.add_typer(real_app, name="real")
app.command()(bench)


def _print_version(wanted: bool) -> None:
    if wanted:
        typer.echo(f"roboirg {roboirg.__version__}")
        raise typer.Exit


# Eager: asked for the version, the command wants no subcommand.
_Version = Annotated[
    bool,
    typer.Option("--version", callback=_print_version, is_eager=True, help="Say the version."),
]


@app.callback()
def _options(*, version: _Version = False) -> None:
    del version


app.command()(run_commands.run)
app.command()(run_commands.merge)
app.command()(report_commands.report)
app.command()(report_commands.view)
app.command()(report_commands.tables)
app.command()(report_commands.figures)
app.command()(report_commands.compare)
app.command()(policy_commands.serve)
app.command("check-policy")(policy_commands.check_policy)
language_commands.export_app.command("records")(run_commands.export_records)


@app.command()
def demo(
    out: Out = "runs/demo",
    episodes: Annotated[str, typer.Option(help="4: the first four; or a list.")] = "2-2",
    video: Video = "all",
    workers: Workers = None,
) -> None:
    """Oracle, listener and forgetful on every task and setting, filmed; ends with a page."""
    from roboirg.analysis.page.report import check_report_support
    from roboirg.evaluation.executors.executor import choose_executor
    from roboirg.evaluation.plan import make_plan

    folder = run_commands.folder_of(out)
    plan = make_plan(DEMO_POLICIES, episodes=episodes, video=video)
    check_report_support()
    summary = run_commands.play(plan, folder, choose_executor(workers), retry=True)
    run_commands.print_tables_of(folder)
    typer.echo(_write_page(folder, videos=True))
    run_commands.report_problems(summary, folder)


@app.command()
def doctor() -> None:
    """Check that episodes can be played here, and say what is missing."""
    from roboirg.doctor import run_doctor

    raise typer.Exit(run_doctor())


@app.command("tasks")
def list_tasks() -> None:
    """List the tasks, their suites and their settings."""
    from roboirg.language import settings_of
    from roboirg.tasks import every_task

    for task in every_task().values():
        typer.echo(f"{task.name:<16} {task.suite:<12} {', '.join(settings_of(task))}")


@app.command("build-splits")
def build_splits(
    tasks: Tasks = "all",
    split: Annotated[str, typer.Option(help="train, val or test; all by default.")] = "all",
    workers: Workers = None,
    out: Annotated[str | None, typer.Option(help="File to write instead of stdout.")] = None,
) -> None:
    """Find anew which seeds the splits pass over; what is not named stays as it is shipped."""
    from rich.console import Console

    from roboirg.core.episode import SPLITS
    from roboirg.episodes import splits
    from roboirg.evaluation.executors.executor import core_count
    from roboirg.evaluation.plan_parsing import means_all, parse_names
    from roboirg.evaluation.seed_selection import (
        check_kept_splits,
        episode_slots,
        find_seeds,
        merge_splits,
    )
    from roboirg.evaluation.seed_summary import follow_progress, print_summary
    from roboirg.records.store import write_atomically
    from roboirg.tasks import find_tasks

    names = find_tasks(parse_names("task", tasks))
    wanted = SPLITS if means_all(split) else (splits.check_split(split),)
    check_kept_splits(names, wanted, splits.shipped_splits())
    if out is not None and not Path(out).parent.is_dir():
        raise InvalidValueError(f"There is no folder for {out!r}; make it first.")
    slots = episode_slots(names, wanted)
    console = Console(stderr=True)
    count = core_count() if workers is None else workers
    found = follow_progress(find_seeds(slots, count), slots, console)
    print_summary(found, console)
    text = splits.splits_text(merge_splits(found, splits.shipped_splits()))
    if out is None:
        typer.echo(text, nl=False)
    else:
        write_atomically(Path(out), text)


@app.command()
def show(
    task: Annotated[str, typer.Argument(help="Name of the task.")],
    episode: Annotated[int, typer.Argument(help="0-based position in the split.")],
    split: Split = "test",
    out: Annotated[
        str | None, typer.Option(help="The PNG file; TASK-split-episode.png by default.")
    ] = None,
) -> None:
    """Print an episode's scene and words, and draw how the oracle plays it."""
    from rich.console import Console

    from roboirg.episodes.splits import get_episode
    from roboirg.visualization.episode_text import print_episode
    from roboirg.visualization.playthrough import draw_sheet

    found = get_episode(task, split, episode)
    path = Path(f"{task}-{split}-{episode}.png" if out is None else out)
    if path.suffix.lower() != ".png" or path.is_dir():
        raise InvalidValueError(f"{str(path)!r} is no name for a picture; it must end in .png.")
    console = Console()
    print_episode(found, console)
    verdict = draw_sheet(found, path)
    console.print(f"[bold]the oracle[/] {verdict}", highlight=False)
    typer.echo(path)


@app.command()
def instruct(
    task: Annotated[str, typer.Argument(help="Name of the task.")],
    episode: Annotated[int, typer.Argument(help="0-based position in the split.")],
    setting: Annotated[str, typer.Option(help="One of the settings, or all.")] = "all",
    form: Annotated[str, typer.Option(help="implicit or resolved.")] = "implicit",
    split: Split = "test",
    stages: Stages = "1-5",
    distractor: Distractor = "neutral",
    frame: Frame = "robot",
) -> None:
    """Print what is said to the robot, turn by turn."""
    from roboirg.episodes.splits import get_episode
    from roboirg.evaluation.plan_parsing import means_all, parse_stages
    from roboirg.language import instruct as make_instruction
    from roboirg.language import settings_of
    from roboirg.tasks import get_task

    spoken = parse_stages(stages)
    found = get_episode(task, split, episode)
    for name in settings_of(get_task(task)) if means_all(setting) else (setting,):
        instruction = make_instruction(
            found, name, form, stages=spoken, distractor=distractor, frame=frame
        )
        typer.echo(typer.style(f"{name}:", bold=True))
        for utterance in instruction.utterances:
            typer.echo(f"  {utterance.stage:<13} {utterance.text}")


def main() -> None:
    """The console script: errors are one sentence on stderr, never a traceback."""
    try:
        code = app(prog_name="roboirg", standalone_mode=False)
    except RoboIRGError as error:
        typer.echo(f"roboirg: {error}", err=True)
        sys.exit(USAGE_ERROR)
    except _WrongUsage as error:
        sys.exit(_print_usage_error(error))
    except typer.Abort:
        sys.exit(INTERRUPTED)
    # What `typer.Exit` was raised with; commands themselves return nothing.
    sys.exit(code)


def _print_usage_error(error: Exception) -> int:
    """Tell what was wrong with the words of the command line; the exit code."""
    # By name, for the same reason.
    message = str(getattr(error, "format_message", error.__str__)())
    if type(error).__name__ == "NoArgsIsHelpError":
        typer.echo(message.rstrip(), err=True)
        return USAGE_ERROR
    words = " ".join(message.split()).rstrip(".")
    if len(words) > _MAX_MESSAGE_LENGTH:
        words = f"{words[:_MAX_MESSAGE_LENGTH]}…"
    context = getattr(error, "ctx", None)
    command = getattr(context, "command_path", "roboirg")
    typer.echo(f"roboirg: {words}; see {command} --help.", err=True)
    return USAGE_ERROR


def _write_page(folder: Path, *, videos: bool) -> Path:
    from roboirg.analysis.page.report import write_report

    return write_report(folder, planned=run_commands.planned_jobs(folder), videos=videos)
