"""The ``roboirg`` command: parses, calls, prints.

Exit codes: 0 all went well; 2 something was asked for that cannot be, or episodes ended in
errors (one sentence on stderr); 130 stopped by Ctrl-C, 143 by SIGTERM.
"""

from __future__ import annotations

import sys
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

import roboirg
from roboirg.cli import language
from roboirg.cli.bench import bench
from roboirg.cli.options import Distractor, Forms, Frame, Settings, Stages, Tasks, Workers
from roboirg.errors import InvalidValueError, RoboIRGError

if TYPE_CHECKING:
    from roboirg.evaluation.plan import Plan
    from roboirg.evaluation.runner import Summary

# Everything heavy is imported inside the commands, so that --help answers at once.

USAGE_ERROR, INTERRUPTED, TERMINATED = 2, 130, 143

# The base of all that typer raises about the command line has moved between its versions.
_WrongUsage: type[Exception] = next(
    kind
    for kind in typer.BadParameter.__mro__
    if kind.__name__ == "ClickException" and issubclass(kind, Exception)
)
_LONGEST_COMPLAINT = 300

DEMO_POLICIES = ("oracle", "listener", "forgetful")

app = typer.Typer(
    name="roboirg",
    help="RoboIRGBench: does a robot policy understand people who do not spell everything out?",
    no_args_is_help=True,
    add_completion=False,
    pretty_exceptions_enable=False,
    context_settings={"help_option_names": ["-h", "--help"]},
)

app.add_typer(language.language_app, name="language")
app.add_typer(language.export_app, name="export")
app.command()(bench)

Policies = Annotated[
    list[str], typer.Option("--policy", help="Built-in name or package.module:Class; repeatable.")
]
Split = Annotated[str, typer.Option(help="train, val or test.")]
Episodes = Annotated[str, typer.Option(help="4: the first four; or a list such as 0,3,5-9.")]
PolicySeeds = Annotated[str, typer.Option(help="A list of numbers; each plays every episode.")]
MaxSteps = Annotated[int, typer.Option(help="The policy's limit in control steps (20 a second).")]
Video = Annotated[str, typer.Option(help="Which episodes to film: off, failures or all.")]
RetryErrors = Annotated[
    bool, typer.Option(help="Play episodes again whose newest record is an error.")
]
Out = Annotated[str, typer.Option(help="Folder of the run; give the same again to go on.")]
Folder = Annotated[str, typer.Argument(help="The --out folder of a run.")]


def _say_version(wanted: bool) -> None:
    if wanted:
        typer.echo(f"roboirg {roboirg.__version__}")
        raise typer.Exit


# Eager: asked for the version, the command wants no subcommand.
_Version = Annotated[
    bool,
    typer.Option("--version", callback=_say_version, is_eager=True, help="Say the version."),
]


@app.callback()
def _options(*, version: _Version = False) -> None:
    del version


@app.command()
def run(
    policy: Policies,
    out: Out,
    tasks: Tasks = "all",
    settings: Settings = "all",
    forms: Forms = "implicit",
    split: Split = "test",
    episodes: Episodes = "4",
    policy_seeds: PolicySeeds = "0",
    stages: Stages = "1-5",
    distractor: Distractor = "neutral",
    frame: Frame = "robot",
    max_steps: MaxSteps = 1300,
    video: Video = "off",
    workers: Workers = None,
    retry_errors: RetryErrors = True,
) -> None:
    """Play episodes and append one record for each to OUT/records.jsonl; resumes by itself."""
    from roboirg.evaluation.plan import make_plan

    folder = _folder(out)
    # As `python -m` has it: policies in the working directory can be named.
    sys.path.insert(0, str(Path.cwd()))
    plan = make_plan(
        policy,
        tasks=tasks,
        settings=settings,
        forms=forms,
        split=split,
        episodes=episodes,
        policy_seeds=policy_seeds,
        stages=stages,
        distractor=distractor,
        frame=frame,
        max_steps=max_steps,
        video=video,
    )
    summary = _run(plan, folder, workers, retry_errors=retry_errors)
    _print_tables(folder)
    _complain_of_errors(summary)


@app.command()
def report(
    folder: Folder,
    videos: Annotated[bool, typer.Option(help="Put the films into the page.")] = True,
) -> None:
    """Print the table of a run and write FOLDER/report.html, one self-contained page."""
    from roboirg.analysis.report import check_report_support

    path = _folder(folder)
    check_report_support()
    _print_tables(path)
    typer.echo(_write_page(path, videos=videos))


@app.command()
def demo(
    out: Out = "runs/demo",
    episodes: Episodes = "2-2",
    video: Video = "all",
    workers: Workers = None,
) -> None:
    """Oracle, listener and forgetful on every task and setting, filmed; ends with a page."""
    from roboirg.analysis.report import check_report_support
    from roboirg.evaluation.plan import make_plan

    folder = _folder(out)
    plan = make_plan(DEMO_POLICIES, episodes=episodes, video=video)
    check_report_support()
    summary = _run(plan, folder, workers, retry_errors=True)
    _print_tables(folder)
    typer.echo(_write_page(folder, videos=True))
    _complain_of_errors(summary)


@app.command()
def doctor() -> None:
    """Check that episodes can be played here, and say what is missing."""
    from roboirg.doctor import run_doctor

    raise typer.Exit(run_doctor())


@app.command("tasks")
def list_tasks() -> None:
    """List the tasks, their suites and their settings."""
    from roboirg.tasks import all_tasks

    for task in all_tasks().values():
        typer.echo(f"{task.name:<16} {task.suite:<12} {', '.join(task.settings)}")


@app.command("build-splits")
def build_splits(
    tasks: Tasks = "all",
    split: Annotated[str, typer.Option(help="train, val or test; all by default.")] = "all",
    workers: Workers = None,
    out: Annotated[str | None, typer.Option(help="File to write instead of stdout.")] = None,
) -> None:
    """Find anew which seeds the splits pass over; what is not named stays as it is shipped."""
    from rich.console import Console

    from roboirg import splits
    from roboirg.episode import SPLITS
    from roboirg.evaluation.acceptance import check_kept, find_seeds, merged, slots_of
    from roboirg.evaluation.executors import core_count
    from roboirg.evaluation.plan import parse_names, says_all
    from roboirg.evaluation.split_summary import followed, print_summary
    from roboirg.evaluation.store import write_atomically
    from roboirg.tasks import all_tasks, get_task

    typed = tuple(all_tasks()) if says_all(tasks) else parse_names("task", tasks)
    names = [get_task(name).name for name in typed]
    wanted = SPLITS if says_all(split) else (splits.check_split(split),)
    check_kept(names, wanted, splits.shipped())
    if out is not None and not Path(out).parent.is_dir():
        raise InvalidValueError(f"There is no folder for {out!r}; make it first.")
    slots = slots_of(names, wanted)
    console = Console(stderr=True)
    count = core_count() if workers is None else workers
    found = followed(find_seeds(slots, count), slots, console)
    print_summary(found, console)
    text = splits.splits_text(merged(found, splits.shipped()))
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

    from roboirg.showing.playthrough import draw_sheet
    from roboirg.showing.words import print_episode
    from roboirg.splits import get_episode

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
    from roboirg.evaluation.plan import parse_stages, says_all
    from roboirg.language import instruct as make_instruction
    from roboirg.splits import get_episode
    from roboirg.tasks import get_task

    spoken = parse_stages(stages)
    found = get_episode(task, split, episode)
    for name in get_task(task).settings if says_all(setting) else (setting,):
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
        sys.exit(_explain(error))
    except typer.Abort:
        sys.exit(INTERRUPTED)
    # What `typer.Exit` was raised with; commands themselves return nothing.
    sys.exit(code)


def _explain(error: Exception) -> int:
    """Tell what was wrong with the words of the command line; the exit code."""
    # By name, for the same reason.
    message = str(getattr(error, "format_message", error.__str__)())
    if type(error).__name__ == "NoArgsIsHelpError":
        typer.echo(message.rstrip(), err=True)
        return USAGE_ERROR
    words = " ".join(message.split()).rstrip(".")
    if len(words) > _LONGEST_COMPLAINT:
        words = f"{words[:_LONGEST_COMPLAINT]}…"
    context = getattr(error, "ctx", None)
    command = getattr(context, "command_path", "roboirg")
    typer.echo(f"roboirg: {words}; see {command} --help.", err=True)
    return USAGE_ERROR


def _folder(text: str) -> Path:
    if not text.strip():
        raise InvalidValueError("The folder of the run is an empty text; give it a name.")
    return Path(text)


def _run(plan: Plan, out: Path, workers: int | None, *, retry_errors: bool) -> Summary:
    from rich.console import Console

    from roboirg.evaluation.executors import choose_executor
    from roboirg.evaluation.progress import ConsoleReporter
    from roboirg.evaluation.rollout import Player
    from roboirg.evaluation.runner import Terminated, run_plan
    from roboirg.evaluation.video import check_video_support

    if plan.video != "off":
        check_video_support()
    executor = choose_executor(workers)
    try:
        with ConsoleReporter(Console()) as reporter:
            summary = run_plan(
                plan,
                out,
                Player(out, plan.video),
                executor,
                retry_errors=retry_errors,
                reporter=reporter,
            )
    except KeyboardInterrupt as interrupt:
        typer.echo(
            f"Stopped; {out} keeps what ended. The same command goes on from there.", err=True
        )
        sys.exit(TERMINATED if isinstance(interrupt, Terminated) else INTERRUPTED)
    if summary.unfilmed:
        typer.echo(
            f"{len(summary.unfilmed)} of {summary.played} films could not be written, the verdicts "
            f"stand; the first: {summary.unfilmed[0].film_lost}",
            err=True,
        )
    return summary


def _print_tables(folder: Path) -> None:
    from rich.console import Console

    from roboirg.analysis.statistics import make_panels
    from roboirg.analysis.tables import print_failures, print_tables
    from roboirg.evaluation.plan import read_plan
    from roboirg.evaluation.store import read_records

    plan, records, console = read_plan(folder), read_records(folder), Console()
    print_tables(make_panels(records, plan.jobs() if plan else ()), console)
    print_failures(records, console)


def _write_page(folder: Path, *, videos: bool) -> Path:
    from roboirg.analysis.report import write_report
    from roboirg.evaluation.plan import read_plan

    plan = read_plan(folder)
    return write_report(folder, planned=plan.jobs() if plan else (), videos=videos)


def _complain_of_errors(summary: Summary) -> None:
    if not summary.errors:
        return
    first = summary.errors[0]
    typer.echo(
        f"roboirg: {len(summary.errors)} of {len(summary.records)} episodes ended in an error "
        f"and are in no rate; the first ({first.task} {first.split}/{first.episode} "
        f"{first.setting}): {first.cause}",
        err=True,
    )
    sys.exit(USAGE_ERROR)
