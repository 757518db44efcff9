"""The command that checks a policy: ``roboirg check-policy``."""

from __future__ import annotations

from typing import Annotated

import typer

from roboirg.cli.listed_names import ListingCommand
from roboirg.cli.options import add_working_directory
from roboirg.cli.policy_commands import PolicySpec
from roboirg.cli.run_commands import USAGE_ERROR


def check_policy(
    policy: PolicySpec,
    expert: Annotated[
        bool,
        typer.Option(help="Compare with an expert's episode, if the simulator is installed."),
    ] = True,
) -> None:
    """Check a policy on synthetic episodes, and next to the scripted expert.

    Example: roboirg check-policy my_policy:MyPolicy
    """
    from rich.console import Console

    from roboirg.apps.policy_check.expert_episode import record_expert
    from roboirg.apps.policy_check.policy_check import check_policy as check
    from roboirg.apps.policy_check.policy_check import print_check_results

    add_working_directory()
    results = check(policy, record_expert=record_expert if expert else None)
    print_check_results(results, Console())
    if any(result.verdict == "fail" for result in results):
        raise typer.Exit(USAGE_ERROR)


def add_commands(app: typer.Typer) -> None:
    app.command("check-policy", cls=ListingCommand)(check_policy)
