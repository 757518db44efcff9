"""Play policies that are given in Python: specs, classes and objects."""

from __future__ import annotations

import datetime as dt
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from roboirg.core.errors import InvalidValueError
from roboirg.core.policy_ref import PolicyRef
from roboirg.policies.by_name.finding import policy_of
from roboirg.records.run_files import run_folder
from roboirg.runs.plan.plan import Plan
from roboirg.runs.plan.plan_maker import make_plan
from roboirg.runs.run.executor import choose_executor
from roboirg.runs.run.progress import ConsoleReporter
from roboirg.runs.run.runner import episode_runner, run_plan
from roboirg.util.console_width import progress_console

AnyPolicy = str | type[Any] | object
"""A spec as on the command line, a class, or an object with ``reset`` and ``act``."""
AnyPolicies = AnyPolicy | Sequence[AnyPolicy] | Mapping[str, AnyPolicy]
"""One, several, or several by name."""

RUNS = Path("runs")


def python_plan(policies: AnyPolicies, **options: object) -> Plan:
    """Return a checked plan; the options are those of `make_plan`."""
    refs = _policy_refs(policies)
    if any(ref.place == "python" for ref in refs):
        options["policy_process"] = "shared"
    return make_plan(refs, **options)


def play_plan(
    plan: Plan,
    out: str | Path | None,
    *,
    workers: int | None,
    progress: bool,
) -> Path:
    """Play a plan and return the folder of its records.

    Args:
        plan: what to play.
        out: folder; the same one again resumes. None makes a new one in ``runs``.
        workers: processes, None for one per core. A policy that only this process knows is played
            in it.
        progress: whether to show it.
    """
    folder = _new_folder() if out is None else run_folder(out)
    folder = folder.absolute()
    # Objects and classes that no other process can import.
    local_policies = [ref.name for ref in plan.policies if ref.place == "python"]
    if local_policies:
        if workers:
            raise InvalidValueError(
                f"workers is {workers}, but the policy exists in this process only; put its class "
                "into a module that can be imported, or leave workers out."
            )
        workers = 0
    executor = choose_executor(workers, plan.attempts.episode_timeout_s)
    if not progress:
        run_plan(plan, folder, episode_runner(plan, folder), executor)
        return folder

    with ConsoleReporter(progress_console(stderr=True)) as reporter:
        if local_policies:
            reporter.warn(
                f"No other process has {', '.join(local_policies)}: all episodes are played in "
                "this one, one after the other."
            )
        run_plan(plan, folder, episode_runner(plan, folder), executor, reporter=reporter)
    return folder


def _policy_refs(policies: AnyPolicies) -> list[PolicyRef]:
    """Return how each of the given policies is made, with a name of its own.

    A mapping names its policies; in a list, they are named after their classes, and must differ.
    """
    if isinstance(policies, Mapping):
        return [policy_of(policy, name) for name, policy in policies.items()]
    if not isinstance(policies, (list, tuple)):
        return [policy_of(policies)]
    refs = [policy_of(policy) for policy in policies]
    names = [ref.name for ref in refs]
    if len(set(names)) < len(names):
        raise InvalidValueError(
            f"Two policies have the same name ({', '.join(names)}); give a mapping from names of "
            "your own to policies."
        )
    return refs


def _new_folder() -> Path:
    """Return a folder of `RUNS` that does not exist; it is not made yet.

    ``runs/2026-03-01-101500``, or ``runs/2026-03-01-101500-2`` in the same second.
    """
    moment = dt.datetime.now().astimezone().strftime("%Y-%m-%d-%H%M%S")
    folder = RUNS / moment
    number = 1
    while folder.exists():
        number += 1
        folder = RUNS / f"{moment}-{number}"
    return folder
