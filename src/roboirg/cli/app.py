"""The ``roboirg`` command.

Exit codes: 0 success; 2 invalid usage, or episodes ended in errors (one sentence on stderr);
130 stopped by Ctrl-C, 143 by SIGTERM.
"""

from __future__ import annotations

import sys
from functools import partial
from pathlib import Path
from typing import Annotated

import typer

from roboirg.cli import (
    demonstration_commands,
    episode_commands,
    grounding_commands,
    import_commands,
    language_commands,
    people_commands,
    policy_commands,
    report_commands,
    run_commands,
    verification_commands,
)
from roboirg.cli.bench_commands import bench
from roboirg.cli.learn_commands import learn_app
from roboirg.cli.missing_extras import describe_missing
from roboirg.cli.options import (
    Distractor,
    Frame,
    Reasoning,
    Rival,
    Split,
    Stages,
    Tasks,
    Video,
    Wordings,
    Workers,
)
from roboirg.cli.real_commands import real_app
from roboirg.cli.run_commands import INTERRUPTED, USAGE_ERROR, Out
from roboirg.core.errors import InvalidValueError, RoboIRGError
from roboirg.core.printable import printable
from roboirg.core.version import __version__
from roboirg.util.plain_text import counted

# Heavy modules are imported inside the commands, so that --help is fast.

# The base class of typer's usage errors has moved between versions.
_WrongUsage: type[Exception] = next(
    kind
    for kind in typer.BadParameter.__mro__
    if kind.__name__ == "ClickException" and issubclass(kind, Exception)
)
_MAX_MESSAGE_LENGTH = 300

DEMO_POLICIES = ("oracle", "listener", "forgetful")

app = typer.Typer(
    name="roboirg",
    help="RoboIRGBench: test whether robot policies understand implicit references.",
    no_args_is_help=True,
    pretty_exceptions_enable=False,
    context_settings={"help_option_names": ["-h", "--help"]},
)

app.add_typer(language_commands.language_app, name="language")
app.add_typer(language_commands.export_app, name="export")
app.add_typer(grounding_commands.score_app, name="score")
app.add_typer(learn_app, name="learn")
app.add_typer(real_app, name="real")
app.add_typer(people_commands.listen_app, name="listen")
app.add_typer(language_commands.wordings_app, name="wordings")
app.command()(bench)


def _print_version(wanted: bool) -> None:
    if wanted:
        typer.echo(f"roboirg {__version__}")
        raise typer.Exit


# Eager, so that --version needs no subcommand.
_Version = Annotated[
    bool,
    typer.Option(
        "--version", callback=_print_version, is_eager=True, help="Show the version and exit."
    ),
]


@app.callback()
def _options(*, version: _Version = False) -> None:
    del version


app.command()(run_commands.run)
app.command()(run_commands.merge)
app.command()(verification_commands.verify)
app.command()(verification_commands.pack)
app.command()(verification_commands.board)
app.command()(verification_commands.repeat)
app.command()(demonstration_commands.replay)
app.command()(report_commands.report)
app.command()(report_commands.view)
app.command()(report_commands.tables)
app.command()(report_commands.figures)
app.command()(report_commands.compare)
app.command()(import_commands.import_results)
app.command()(people_commands.drive)
app.command(cls=policy_commands.ProtocolHelpCommand)(policy_commands.serve)
app.command("check-policy", cls=policy_commands.ProtocolHelpCommand)(policy_commands.check_policy)
language_commands.export_app.command("grounding")(grounding_commands.export_grounding)
language_commands.export_app.command("episodes")(episode_commands.export_episodes)
language_commands.export_app.command("records")(run_commands.export_records)
language_commands.export_app.command("demonstrations")(demonstration_commands.export_demonstrations)


@app.command()
def demo(
    out: Out = "runs/demo",
    episodes: Annotated[
        str, typer.Option(help="all, 4 for the first four, or a list such as 0,3.")
    ] = "2-2",
    video: Video = "all",
    workers: Workers = None,
) -> None:
    """Play three built-in policies on every task and setting, record videos, write a report."""
    from roboirg.analysis.page.report import check_report_support
    from roboirg.evaluation.executors.executor import choose_executor
    from roboirg.evaluation.plan_maker import make_plan

    folder = run_commands.folder_of(out)
    plan = make_plan(DEMO_POLICIES, episodes=episodes, video=video)
    check_report_support()
    summary = run_commands.play(plan, folder, choose_executor(workers), retry=True)
    run_commands.print_tables_of(folder, run_commands.planned_jobs(folder))
    typer.echo(_write_page(folder, videos=True))
    run_commands.report_problems(summary, folder)


@app.command()
def doctor() -> None:
    """Check whether episodes can be played on this machine, and show what is missing."""
    from roboirg.doctor import run_doctor

    raise typer.Exit(run_doctor())


@app.command("fetch-models")
def fetch_models(
    wheel: Annotated[
        str | None, typer.Option(help="ManiSkill's wheel on this machine; downloaded by default.")
    ] = None,
) -> None:
    """Put the model files of the robot and the table in place, if they are not; print where."""
    from roboirg.simulation.model_fetch import fetch_model_files

    typer.echo(fetch_model_files(Path(wheel) if wheel else None, partial(typer.echo, err=True)))


@app.command("tasks")
def list_tasks() -> None:
    """List the tasks with their suites and settings."""
    from roboirg.language import settings_of
    from roboirg.tasks import every_task

    for task in every_task().values():
        typer.echo(f"{task.name:<16} {task.suite:<12} {', '.join(settings_of(task))}")


@app.command("build-splits")
def build_splits(
    tasks: Tasks = "all",
    split: Annotated[str, typer.Option(help="train, val, test or all.")] = "all",
    workers: Workers = None,
    out: Annotated[str | None, typer.Option(help="Write to this file instead of stdout.")] = None,
) -> None:
    """Select the seeds of the splits again; tasks and splits not named stay unchanged."""
    from roboirg.episodes import splits
    from roboirg.evaluation.plan_parsing import parse_names, parse_splits
    from roboirg.evaluation.seed_search.seed_selection import (
        check_kept_splits,
        episode_slots,
        find_seeds,
        merge_splits,
    )
    from roboirg.evaluation.seed_search.seed_summary import follow_progress, print_summary
    from roboirg.tasks import find_tasks
    from roboirg.util.atomic_write import write_atomically
    from roboirg.util.console_width import progress_console
    from roboirg.util.processor import core_count

    names = find_tasks(parse_names("task", tasks))
    wanted = parse_splits(split)
    check_kept_splits(names, wanted, splits.shipped_splits())
    if out is not None and not Path(out).parent.is_dir():
        raise InvalidValueError(f"There is no folder for {out!r}; create it first.")
    slots = episode_slots(names, wanted)
    console = progress_console(stderr=True)
    count = core_count() if workers is None else workers
    found = follow_progress(find_seeds(slots, count), slots, console)
    print_summary(found, console)
    text = splits.splits_text(merge_splits(names, found, splits.shipped_splits()))
    if out is None:
        typer.echo(text, nl=False)
    else:
        write_atomically(Path(out), text)


@app.command()
def show(
    task: Annotated[str, typer.Argument(help="Name of the task.")],
    episode: Annotated[int, typer.Argument(help="Position in the split, from 0.")],
    split: Split = "test",
    out: Annotated[
        str | None, typer.Option(help="PNG file to write; TASK-SPLIT-EPISODE.png by default.")
    ] = None,
) -> None:
    """Print an episode's scene and instructions, and draw how the oracle plays it."""
    from rich.console import Console

    from roboirg.envs.factory import check_simulator
    from roboirg.episodes.splits import get_episode
    from roboirg.visualization.episode_text import print_episode
    from roboirg.visualization.playthrough import draw_sheet

    found = get_episode(task, split, episode)
    path = Path(f"{task}-{split}-{episode}.png" if out is None else out)
    if path.suffix.lower() != ".png" or path.is_dir():
        raise InvalidValueError(f"{str(path)!r} is not a valid picture file; it must end in .png.")
    check_simulator()
    console = Console()
    print_episode(found, console)
    verdict = draw_sheet(found, path)
    console.print(f"[bold]the oracle[/] {verdict}", highlight=False)
    typer.echo(path)


@app.command()
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
    from roboirg.episodes.splits import get_episode
    from roboirg.evaluation.plan_parsing import means_all, parse_stages
    from roboirg.language import instruct as make_instruction
    from roboirg.language import settings_of
    from roboirg.language.token_counts import count_tokens
    from roboirg.language.wordings.wording_store import open_wordings
    from roboirg.tasks import get_task

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


def main() -> None:
    """Run the command; errors are one sentence on stderr, never a traceback."""
    try:
        code = app(prog_name="roboirg", standalone_mode=False)
    except RoboIRGError as error:
        typer.echo(f"roboirg: {printable(str(error))}", err=True)
        sys.exit(USAGE_ERROR)
    except ModuleNotFoundError as error:
        message = describe_missing(error)
        if message is None:
            raise
        typer.echo(f"roboirg: {message}", err=True)
        sys.exit(USAGE_ERROR)
    except _WrongUsage as error:
        sys.exit(_print_usage_error(error))
    except typer.Abort:
        sys.exit(INTERRUPTED)
    # The code of `typer.Exit`; commands return nothing.
    sys.exit(code)


def _print_usage_error(error: Exception) -> int:
    """Print what was wrong with the command line. Returns the exit code."""
    # Compared by name, because the class has moved too.
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
