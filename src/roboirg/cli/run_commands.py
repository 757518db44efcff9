"""Commands that play episodes and handle their records."""

from __future__ import annotations

import os
import sys
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from roboirg.cli.declared_options import EPISODES
from roboirg.cli.options import Workers, add_working_directory
from roboirg.core.errors import InvalidValueError, check_names
from roboirg.core.plain_text import counted, printable, verb_for
from roboirg.util.processor import worker_advice

if TYPE_CHECKING:
    from rich.console import Console

    from roboirg.evaluation.analysis.results.frame import Frame
    from roboirg.evaluation.plan.plan import Plan
    from roboirg.evaluation.plan.sources import Source
    from roboirg.evaluation.records.record import Job
    from roboirg.evaluation.run.executor import Executor
    from roboirg.evaluation.run.runner import RunSummary

# Heavy modules are imported inside the commands, so that --help is fast.

USAGE_ERROR, INTERRUPTED, TERMINATED = 2, 130, 143
EXECUTORS = ("local", "ray")

PlanName = Annotated[
    str | None,
    typer.Option(
        "--plan",
        help="YAML file or a run's plan.json; or challenge, demo, paper, paper-context, "
        "paper-planners, quick, robomme or standard.",
        rich_help_panel=EPISODES,
    ),
]
Folder = Annotated[str, typer.Argument(help="Output folder of a run.")]
RetryErrors = Annotated[
    bool,
    typer.Option(
        help="Play episodes again if their newest record is an error.",
    ),
]


def run(
    context: typer.Context,
    out: Annotated[
        str | None,
        typer.Option(
            help="Output folder; give the same folder again to resume.", show_default="required"
        ),
    ] = None,
    plan: PlanName = None,
    workers: Workers = None,
    executor: Annotated[
        str, typer.Option(help="Where to play: local, or ray (cluster address in RAY_ADDRESS).")
    ] = "local",
    retry_errors: RetryErrors = True,
    dry_run: Annotated[
        bool,
        typer.Option("--dry-run", help="Only check, and count episodes and calls of models."),
    ] = False,
    show_plan: Annotated[
        bool,
        typer.Option("--show-plan", help="Only print the plan, with all fields explained."),
    ] = False,
) -> None:
    """Play episodes and store a record of each in OUT/records.jsonl; resumes where it stopped.

    What has no option here, such as time limits, is a field of the plan's file (--show-plan).

    Example: roboirg run --policy oracle --tasks PickXtimes --out runs/first
    """
    from roboirg.evaluation.plan.plan_file import plan_text
    from roboirg.evaluation.plan.sources import Source
    from roboirg.evaluation.play.prompt_shares import prompt_shares, warning_lines
    from roboirg.evaluation.play.video_writer import check_video_support
    from roboirg.evaluation.records.run_files import run_folder
    from roboirg.evaluation.run.runner import check_run

    add_working_directory(last=True)
    made = _plan(plan, context.obj, usual=("oracle",) if show_plan else ())
    if show_plan:
        typer.echo(plan_text(made), nl=False)
        return
    if out is None:
        raise InvalidValueError("No folder given; name one with --out, such as runs/first.")
    # Absolute: a policy in this process may change the working directory.
    folder = run_folder(out).absolute()
    chosen = _executor(made, executor, workers)
    if made.video != "off":
        check_video_support()
    check_run(made, folder)
    if dry_run:
        _print_counts(made, folder)
        return
    for line in warning_lines(prompt_shares(made.jobs())):
        typer.echo(line, err=True)
    summary = play(made, folder, chosen, retry=retry_errors)
    print_tables_of(Source(folder))
    report_problems(summary, folder)


def play(plan: Plan, out: Path, executor: Executor, *, retry: bool) -> RunSummary:
    """Play a plan with a progress bar; exits the process when it is interrupted."""
    from roboirg.evaluation.episode_errors import Terminated
    from roboirg.evaluation.run.progress import ConsoleReporter
    from roboirg.evaluation.run.runner import episode_runner, run_plan
    from roboirg.util.console_width import progress_console
    from roboirg.util.freed_memory import keep_freed_memory

    keep_freed_memory()
    play_job = episode_runner(plan, out)
    try:
        with ConsoleReporter(progress_console()) as reporter:
            return run_plan(plan, out, play_job, executor, retry_errors=retry, reporter=reporter)
    except KeyboardInterrupt as interrupt:
        typer.echo(
            f"Stopped; finished episodes are stored in {out}. Run the same command to resume.",
            err=True,
        )
        sys.exit(TERMINATED if isinstance(interrupt, Terminated) else INTERRUPTED)


def print_tables_of(source: Source) -> None:
    """Print the tables of a run, what is mixed in it, and its unsuccessful episodes."""
    from rich.console import Console

    from roboirg.evaluation.analysis.results.reading import read_frame
    from roboirg.evaluation.analysis.tables.rendering.terminal import print_tables
    from roboirg.evaluation.analysis.tables.run_tables import make_run_tables, print_failures

    frame, console = read_frame([source]), Console()
    print_tables(make_run_tables(frame), console)
    warn_of_mixtures(frame)
    print_failures(frame, console)


def warn_of_mixtures(*frames: Frame) -> None:
    """Print on stderr what the results do not have in common; control arms are left out."""
    from roboirg.evaluation.records.mixing import mixtures

    for sentence in mixtures([one for frame in frames for one in frame.told().played]):
        typer.echo(sentence, err=True)


def report_problems(summary: RunSummary, folder: Path) -> None:
    """Print errors and missing episodes of a run on stderr; exits with 2 if there are any."""
    if summary.video_errors:
        typer.echo(
            f"{len(summary.video_errors):,} of {counted(summary.played, 'video')} could not be "
            f"written; the verdicts are not affected. First error: {summary.video_errors[0]}",
            err=True,
        )
    if summary.errors:
        first = summary.errors[0]
        verb = verb_for(len(summary.errors), "are")
        typer.echo(
            f"roboirg: {len(summary.errors):,} of {counted(summary.total, 'episode')} ended in an "
            f"error and {verb} not counted in the rates; the first ({first.task} "
            f"{first.split}/{first.episode} {first.setting}): {printable(str(first.cause))}",
            err=True,
        )
    if summary.missing:
        verb = verb_for(summary.missing, "were")
        typer.echo(
            f"roboirg: {summary.missing:,} of {counted(summary.total, 'episode')} {verb} not "
            f"played; run the same command to complete {folder}.",
            err=True,
        )
    if summary.errors or summary.missing:
        sys.exit(USAGE_ERROR)


def _plan(name: str | None, typed: dict[str, Any], usual: Sequence[str]) -> Plan:
    """Return the plan of a file, overridden by the options that were typed.

    `usual` are its policies if it has none.
    """
    from roboirg.evaluation.plan.plan import FLAT
    from roboirg.evaluation.plan.plan_file import read_plan_file
    from roboirg.evaluation.plan.plan_maker import make_plan
    from roboirg.tasks.splits.private_splits import drawn_split

    chosen = {} if name is None else read_plan_file(name)
    for option in FLAT.keys() & typed.keys():
        section = chosen.get(FLAT[option])
        if isinstance(section, dict):
            section.pop(option, None)
    chosen |= typed
    policies = chosen.pop("policies", None) or usual
    if not policies:
        raise InvalidValueError("No policy given; name one with --policy, such as oracle.")
    chosen["split"] = drawn_split(str(chosen.get("split", "test")))
    return make_plan(policies, **chosen)


def _executor(plan: Plan, name: str, workers: int | None) -> Executor:
    check_names("executor", [name], EXECUTORS)
    if name == "ray":
        from roboirg.evaluation.run.ray_cluster import RayCluster

        address = os.environ.get("RAY_ADDRESS")
        variables = plan.cluster.variables + plan.hosting.policy_env
        needs = replace(plan.cluster, variables=variables)
        return RayCluster(workers, address, plan.attempts.episode_timeout_s, needs)
    from roboirg.evaluation.run.executor import choose_executor

    return choose_executor(workers, plan.attempts.episode_timeout_s)


def _print_counts(plan: Plan, folder: Path) -> None:
    from rich.console import Console

    from roboirg.evaluation.records.record_codec import identity_key
    from roboirg.evaluation.records.store import read_index
    from roboirg.evaluation.run.plan_counts import cell_sizes
    from roboirg.language.settings import EXPLICIT

    jobs, console = plan.jobs(), Console()
    sizes = cell_sizes(jobs)
    settings = tuple(dict.fromkeys(setting for cells in sizes.values() for setting in cells))
    rows = [
        (*names, *(" + ".join(map(str, cells.get(one, {}).values())) or "–" for one in settings))
        for names, cells in sizes.items()
    ]
    forms = dict.fromkeys(job.form for job in jobs if job.setting != EXPLICIT)  # it has one form
    caption = f"episodes: {' + '.join(forms)}" if forms else "episodes"
    heads = ("policy", "task", *settings)
    _print_table(console, f"plan {plan.fingerprint}", heads, rows, caption)
    for arm, count in plan.left_out(jobs).items():
        console.print(f"{arm}: {counted(count, 'episode')} left out.", highlight=False)
    _print_prompt_shares(plan, jobs, settings, console)
    played = read_index(folder)
    todo = [job for job in jobs if identity_key(job) not in played]
    stored = len(jobs) - len(todo)
    console.print(f"{counted(len(jobs), 'episode')}, {stored:,} already stored.", highlight=False)
    console.print(f"Workers: {worker_advice()}.", highlight=False)
    _print_model_calls(todo, console)


def _print_table(
    console: Console,
    title: str,
    heads: Sequence[str],
    rows: Sequence[Sequence[str]],
    caption: str | None = None,
) -> None:
    """Print a table, if it has rows; all columns but those of names are numbers."""
    from rich.table import Table

    from roboirg.util.console_width import widen

    table = Table(title=title, title_justify="left", caption=caption)
    for head in heads:
        is_name = head in ("policy", "task", "setting")
        table.add_column(head, justify="left" if is_name else "right")
    for row in rows:
        table.add_row(*row)
    if rows:
        widen(console, table)
        console.print(table)


def _print_model_calls(todo: Sequence[Job], console: Console) -> None:
    """Print how often models will be asked at least, if policies ask any."""
    from roboirg.evaluation.run.plan_counts import least_calls

    rows = [(*names, f"{calls:,}") for names, calls in least_calls(todo).items()]
    _print_table(console, "least calls of models", ("policy", "setting", "calls"), rows)
    if rows:
        console.print(
            "A listener is asked once an episode, a planner at least once a subgoal; planners that "
            "are asked before every chunk, second questions and retried episodes need more."
        )


def _print_prompt_shares(
    plan: Plan, jobs: tuple[Job, ...], settings: tuple[str, ...], console: Console
) -> None:
    """Print how many instructions the policies that declare a limit do not read whole."""
    from roboirg.core.policy_ref import BUILT_IN
    from roboirg.evaluation.play.prompt_shares import prompt_shares, share_text

    shares = prompt_shares(jobs)
    rows = []
    for one in shares:
        if one.limit is not None:
            counts = (one.settings.get(setting) for setting in settings)
            row = ("–" if count is None else share_text(count) for count in counts)
            rows.append((one.policy, f"{one.limit.tokens} tokens", *row))
    title = "instructions cut off at a policy's limit"
    _print_table(console, title, ("policy", "reads", *settings), rows)
    ours = {one.name for one in plan.policies if one.kind == BUILT_IN}
    undeclared = [one.policy for one in shares if one.limit is None and one.policy not in ours]
    if undeclared:
        console.print(
            f"No limit declared (prompt_tokens=N), so cuts are unknown: {', '.join(undeclared)}.",
            highlight=False,
            markup=False,
        )
