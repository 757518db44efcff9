"""The command that shows what the benchmark does: ``roboirg demo``."""

from __future__ import annotations

from typing import Annotated

import typer

from roboirg.cli import run_commands
from roboirg.cli.run_commands import Out
from roboirg.core.errors import MissingDependencyError

DEMO_POLICIES = ("oracle", "listener", "forgetful")


def demo(
    out: Out = "runs/demo",
    episodes: Annotated[
        str, typer.Option(help="all, 4 for the first four, or a list such as 0,3.")
    ] = "2-2",
) -> None:
    """Play three built-in policies on every task and setting, with videos, and write a report.

    Example: roboirg demo --out runs/demo
    """
    from roboirg.evaluation.analysis.page.report import check_report_support, write_report
    from roboirg.evaluation.plan.plan_maker import make_plan
    from roboirg.evaluation.play.video_writer import check_video_support
    from roboirg.evaluation.run.executor import choose_executor

    folder = run_commands.folder_of(out)
    check_report_support()
    video = "all"
    try:
        check_video_support()
    except MissingDependencyError as error:
        typer.echo(f"Without videos: {error}", err=True)
        video = "off"
    plan = make_plan(DEMO_POLICIES, episodes=episodes, video=video, seed_secret="")
    summary = run_commands.play(plan, folder, choose_executor(), retry=True)
    run_commands.print_tables_of(folder, run_commands.planned_jobs(folder))
    typer.echo(write_report(folder, planned=run_commands.planned_jobs(folder), videos=True))
    run_commands.report_problems(summary, folder)
