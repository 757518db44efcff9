"""Check that a policy keeps the contract, on synthetic episodes and next to the expert."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import TYPE_CHECKING

from roboirg.apps.policy_check.check_result import CheckAbortedError, CheckResult
from roboirg.apps.policy_check.contract_checks import (
    check_acting,
    check_determinism,
    check_loading,
    check_reports,
    check_requirements,
    check_reset,
    check_version,
)
from roboirg.apps.policy_check.expert_check import check_expert
from roboirg.apps.policy_check.expert_episode import RecordExpert
from roboirg.apps.policy_check.policy_player import PolicyPlayer
from roboirg.core.plain_text import counted
from roboirg.policies.contract.base import Policy

if TYPE_CHECKING:
    from rich.console import Console

Check = Callable[[PolicyPlayer], Iterator[CheckResult]]

CHECKS: tuple[Check, ...] = (
    check_loading,
    check_requirements,
    check_version,
    check_acting,
    check_reports,
    check_determinism,
    check_reset,
)
"""In order; each may rely on what those before it found out."""


def check_policy(
    policy: str | Policy, *, seed: int = 0, record_expert: RecordExpert | None = None
) -> list[CheckResult]:
    """Check a policy on synthetic episodes, and next to the scripted expert.

    Args:
        policy: a spec as for `roboirg.policies.make_policy`, or an object, which is reset wherever
            a spec would give a fresh object.
        seed: of the policy and of the synthetic episodes.
        record_expert: returns an episode of the expert, as
            `roboirg.apps.policy_check.expert_episode.record_expert` does with the simulator; None
            to compare with none.

    Returns:
        The results in the order of the checks, which end at the first that makes others
        impossible.

    Raises:
        MissingDependencyError: a library that the policy needs is not installed.
    """
    results: list[CheckResult] = []
    player = PolicyPlayer(policy, seed)
    try:
        for check in CHECKS:
            results.extend(check(player))
        results.extend(check_expert(player, record_expert))
    except CheckAbortedError as error:
        results.append(CheckResult(*error.args))
    finally:
        player.close()
    return results


def print_check_results(results: list[CheckResult], console: Console) -> None:
    """Print a table of results, and in a last line how many checks failed or warn."""
    from rich.markup import escape
    from rich.table import Table

    from roboirg.core.plain_text import printable

    styles = {"pass": "green", "fail": "bold red", "warn": "bold yellow", "note": "yellow"}
    table = Table(box=None, pad_edge=False)
    for heading in ("check", "", "result"):
        table.add_column(heading)
    for result in results:
        verdict = f"[{styles[result.verdict]}]{result.verdict}[/]"
        table.add_row(result.check, verdict, escape(printable(result.message)))
    console.print(table, highlight=False)
    console.print(_summary(results))


def _summary(results: list[CheckResult]) -> str:
    """Return a sentence on how many checks failed or warn: ``9 checks, none failed, 1 warning``."""
    verdicts = [result.verdict for result in results]
    failed = verdicts.count("fail")
    warned = verdicts.count("warn")
    checks = counted(len(results), "check")
    summary = f"{checks}, none failed"
    if failed:
        summary = f"{failed} of {checks} failed"
    if warned:
        summary += f", {counted(warned, 'warning')}"
    return f"{summary}."
