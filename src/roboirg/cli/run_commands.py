"""Commands that play episodes and handle their records."""

from __future__ import annotations

import itertools
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

    from roboirg.analysis.results.frame import Frame
    from roboirg.analysis.results.sources import Source
    from roboirg.records.record import Job, Summary
    from roboirg.runs.plan.plan import Plan
    from roboirg.runs.run.executor import Executor
    from roboirg.runs.run.runner import RunSummary

# Heavy modules are imported inside the commands, so that --help is fast.

USAGE_ERROR = 2
INTERRUPTED = 130
TERMINATED = 143
"""Exit codes."""
EXECUTORS = ("local", "ray")

RunPlan = Annotated[
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
        help="Replay episodes that ended in an error.",
    ),
]


def run(
    context: typer.Context,
    out: Annotated[
        str | None,
        typer.Option(
            help="Output folder; give the same folder again to resume.",
            show_default="required, but for --dry-run",
        ),
    ] = None,
    plan: RunPlan = None,
    workers: Workers = None,
    executor: Annotated[
        str, typer.Option(help="Where to play: local, or ray (cluster address in RAY_ADDRESS).")
    ] = "local",
    retry_errors: RetryErrors = True,
    until_decided: Annotated[
        bool,
        typer.Option(
            "--until-decided",
            help="Stop once it is clear how policies or settings differ.",
        ),
    ] = False,
    against: Annotated[
        str | None,
        typer.Option(help="Likewise, against RUN:POLICY.", show_default=False),
    ] = None,
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
    from roboirg.analysis.results.sources import Source
    from roboirg.analysis.results.stored_side import against_stored
    from roboirg.records.run_files import run_folder
    from roboirg.runs.plan.plan_file import plan_text
    from roboirg.runs.plan.plan_sections import StopRule
    from roboirg.runs.play.video_writer import check_video_support
    from roboirg.runs.run.runner import check_run

    add_working_directory(last=True)
    # The plan that is shown needs no policy, so it gets one as an example.
    usual = ("oracle",) if show_plan else ()
    made = _plan(plan, context.obj, usual)
    if made.stop is None and (until_decided or against is not None):
        made = _plan(plan, {**context.obj, "stop": StopRule()}, usual)
    if show_plan:
        typer.echo(plan_text(made), nl=False)
        return
    if out is None and not dry_run:
        raise InvalidValueError("No folder given; name one with --out, such as runs/first.")
    chosen = _executor(made, executor, workers)
    if made.video != "off":
        check_video_support()
    if out is None:
        _print_counts(made, None, against)
        return
    # Absolute: a policy in this process may change the working directory.
    folder = run_folder(out).absolute()
    check_run(made, folder)
    if dry_run:
        _print_counts(made, folder, against)
        return
    if against is not None:
        made = against_stored(made, against, folder)
    _print_warnings(made)
    summary = play(made, folder, chosen, retry=retry_errors)
    print_tables_of(Source(folder))
    report_problems(summary, folder)


def _print_warnings(plan: Plan) -> None:
    """Print on stderr what a user should know before a plan is played."""
    from roboirg.runs.play.prompt_shares import prompt_shares, warning_lines

    if plan.stop is not None and len(plan.policies) > 1:
        names = " and ".join(policy.name for policy in plan.policies)
        typer.echo(f"Scene by scene, so {names} stay loaded at the same time.", err=True)
    for line in warning_lines(prompt_shares(plan.jobs())):
        typer.echo(line, err=True)


def play(plan: Plan, out: Path, executor: Executor, *, retry: bool) -> RunSummary:
    """Play a plan with a progress bar, and return what came of it.

    Ends this process when it is interrupted; finished episodes are stored by then.

    Args:
        plan: what to play.
        out: folder of the run.
        executor: plays the episodes.
        retry: whether to play again what is stored as an error.
    """
    from roboirg.runs.episode_errors import Terminated
    from roboirg.runs.run.progress import ConsoleReporter
    from roboirg.runs.run.runner import episode_runner, run_plan
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
    """Print the tables of a run, what is mixed in it, and its unsuccessful episodes.

    The tables go to stdout, warnings of mixed versions to stderr.
    """
    from rich.console import Console

    from roboirg.analysis.results.reading import read_frame
    from roboirg.analysis.tables.rendering.terminal import print_tables
    from roboirg.analysis.tables.run_tables import make_run_tables, print_failures

    frame = read_frame([source])
    console = Console()
    print_tables(make_run_tables(frame), console)
    warn_of_mixtures(frame)
    print_failures(frame, console)


def warn_of_mixtures(*frames: Frame) -> None:
    """Print on stderr what differs between the results, such as versions of the environment.

    Episodes of control arms differ on purpose, so they are left out.
    """
    from roboirg.records.mixing import mixtures

    played: list[Summary] = []
    for frame in frames:
        played += frame.without_control_arms().played
    for sentence in mixtures(played):
        typer.echo(sentence, err=True)


def report_problems(summary: RunSummary, folder: Path) -> None:
    """Print errors and missing episodes of a run on stderr; exit with 2 if there are any.

    Videos that could not be written are printed, too, but are no reason to exit.
    """
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

    Args:
        name: of the plan or its file; None for a plan of typed options alone.
        typed: options by name; typed ones count before those of the file.
        usual: the policies of a plan that names none; empty to refuse such a plan.

    Raises:
        InvalidValueError: there is no policy, or an option is wrong.
    """
    from roboirg.runs.plan.plan_fields import FLAT
    from roboirg.runs.plan.plan_file import read_plan_file
    from roboirg.runs.plan.plan_maker import make_plan
    from roboirg.tasks.splits.private_splits import drawn_split

    fields = {} if name is None else read_plan_file(name)
    # A plan refuses an option that stands both inside and outside of its section. A typed one
    # stands outside, so it is removed from the section that the file may have.
    for option in FLAT.keys() & typed.keys():
        section = fields.get(FLAT[option])
        if isinstance(section, dict):
            section.pop(option, None)
    fields |= typed
    policies = fields.pop("policies", None) or usual
    if not policies:
        raise InvalidValueError("No policy given; name one with --policy, such as oracle.")
    fields["split"] = drawn_split(str(fields.get("split", "test")))
    return make_plan(policies, **fields)


def _executor(plan: Plan, name: str, workers: int | None) -> Executor:
    """Return what plays the episodes of a plan: processes of this machine, or a Ray cluster.

    Args:
        plan: with the time limit of an episode, and what a cluster needs.
        name: ``local`` or ``ray``.
        workers: number of workers; None for as many as suit the machine or cluster.
    """
    check_names("executor", [name], EXECUTORS)
    if name == "ray":
        from roboirg.runs.run.ray_cluster import RayCluster

        address = os.environ.get("RAY_ADDRESS")
        variables = plan.cluster.variables + plan.hosting.policy_env
        needs = replace(plan.cluster, variables=variables)
        return RayCluster(workers, address, plan.attempts.episode_timeout_s, needs)
    from roboirg.runs.run.executor import choose_executor

    return choose_executor(workers, plan.attempts.episode_timeout_s)


def _print_counts(plan: Plan, folder: Path | None, against: str | None) -> None:
    """Print what ``--dry-run`` shows: how many episodes there are and are stored, and calls.

    Args:
        plan: what would be played.
        folder: of the run, which may not exist yet; None if it was not named.
        against: a stored policy, whose results are copied before the plan is played; or None.

    Raises:
        InvalidValueError: the plan stops when it is decided and has nothing to compare.
    """
    from rich.console import Console

    from roboirg.records.record_codec import identity_key
    from roboirg.records.store import read_index
    from roboirg.runs.plan.stopping import find_stopping

    console = Console()
    jobs = plan.jobs()
    played = {} if folder is None else read_index(folder)
    if plan.stop is not None and against is None:
        find_stopping(plan, jobs, played.values())
    settings = _print_sizes(plan, jobs, console)
    for arm, count in plan.left_out(jobs).items():
        console.print(f"{arm}: {counted(count, 'episode')} left out.", highlight=False)
    _print_prompt_shares(plan, jobs, settings, console)
    todo = [job for job in jobs if identity_key(job) not in played]
    stored = len(jobs) - len(todo)
    console.print(f"{counted(len(jobs), 'episode')}, {stored:,} already stored.", highlight=False)
    console.print(f"Workers: {worker_advice()}.", highlight=False)
    _print_model_calls(todo, console)


def _print_sizes(plan: Plan, jobs: tuple[Job, ...], console: Console) -> tuple[str, ...]:
    """Print a table with the number of episodes by policy and task (rows) and setting (columns).

    If instructions have several forms, a cell has a number for each: ``50 + 50``.

    Returns:
        The settings, in the order of the columns.
    """
    from roboirg.language.settings import EXPLICIT
    from roboirg.runs.run.plan_counts import cell_sizes

    sizes = cell_sizes(jobs)
    settings = tuple(dict.fromkeys(itertools.chain.from_iterable(sizes.values())))
    rows = []
    for (policy, task), counts_by_setting in sizes.items():
        cells = [policy, task]
        for setting in settings:
            counts = counts_by_setting.get(setting, {}).values()  # by form
            cells.append(" + ".join(map(str, counts)) or "–")
        rows.append(cells)

    caption = "episodes"
    # The explicit setting always has the same one form, so it is not listed.
    forms = dict.fromkeys(job.form for job in jobs if job.setting != EXPLICIT)
    if forms:
        caption = f"episodes: {' + '.join(forms)}"
    heads = ("policy", "task", *settings)
    _print_table(console, f"plan {plan.fingerprint}", heads, rows, caption)
    return settings


def _print_table(
    console: Console,
    title: str,
    heads: Sequence[str],
    rows: Sequence[Sequence[str]],
    caption: str | None = None,
) -> None:
    """Print a table, if it has rows; columns of numbers stand to the right.

    Args:
        console: where to print.
        title: above the table.
        heads: of the columns; only those of policy, task and setting are no numbers.
        rows: of the table, with a text for each column.
        caption: below the table; None for none.
    """
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
    """Print how often the policies will ask a model at least; nothing if none asks one.

    Args:
        todo: the jobs that are not stored yet.
        console: where to print.
    """
    from roboirg.runs.run.plan_counts import least_calls

    rows: list[tuple[str, ...]] = []
    for (policy, setting), calls in least_calls(todo).items():
        rows.append((policy, setting, f"{calls:,}"))
    _print_table(console, "least calls of models", ("policy", "setting", "calls"), rows)
    if rows:
        console.print(
            "A listener is asked once an episode, a planner at least once a subgoal; planners that "
            "are asked before every chunk, second questions and retried episodes need more."
        )


def _print_prompt_shares(
    plan: Plan, jobs: tuple[Job, ...], settings: tuple[str, ...], console: Console
) -> None:
    """Print how many instructions are too long for the policies that declare a limit of tokens.

    A row for each such policy, a column for each of `settings`. Policies that declare no limit are
    named below the table, but for the built-in ones, which read every instruction.
    """
    from roboirg.core.policy_ref import BUILT_IN
    from roboirg.runs.play.prompt_shares import prompt_shares, share_text

    built_in = {policy.name for policy in plan.policies if policy.kind == BUILT_IN}
    rows: list[tuple[str, ...]] = []
    undeclared = []
    for shares in prompt_shares(jobs):
        if shares.limit is not None:
            cells = []
            for setting in settings:
                verdicts = shares.settings.get(setting)
                cells.append("–" if verdicts is None else share_text(verdicts))
            rows.append((shares.policy, f"{shares.limit.tokens} tokens", *cells))
        elif shares.policy not in built_in:
            undeclared.append(shares.policy)
    title = "instructions cut off at a policy's limit"
    _print_table(console, title, ("policy", "reads", *settings), rows)
    if undeclared:
        console.print(
            f"No limit declared (prompt_tokens=N), so cuts are unknown: {', '.join(undeclared)}.",
            highlight=False,
            markup=False,
        )
