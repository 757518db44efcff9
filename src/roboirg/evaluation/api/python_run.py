"""Play policies that are given in Python: specs, classes and objects."""

from __future__ import annotations

import contextlib
import datetime as dt
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from roboirg.core.errors import InvalidValueError
from roboirg.core.policy_ref import PolicyRef
from roboirg.evaluation.plan.plan import Plan
from roboirg.evaluation.plan.plan_maker import make_plan
from roboirg.evaluation.records.run_files import run_folder
from roboirg.evaluation.run.executor import choose_executor
from roboirg.evaluation.run.progress import ConsoleReporter
from roboirg.evaluation.run.runner import episode_runner, run_plan
from roboirg.policies.by_name.finding import policy_of
from roboirg.util.console_width import progress_console

AnyPolicy = str | type[Any] | object
"""A spec as on the command line, a class, or an object with ``reset`` and ``act``."""
AnyPolicies = AnyPolicy | Sequence[AnyPolicy] | Mapping[str, AnyPolicy]
"""One, several, or several by name."""

RUNS = Path("runs")


def python_plan(policies: AnyPolicies, **options: object) -> Plan:
    """Return a checked plan; the options are those of `make_plan`."""
    refs = _named(policies)
    if any(one.place == "python" for one in refs):
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
    here = [one.name for one in plan.policies if one.place == "python"]
    if here:
        if workers:
            raise InvalidValueError(
                f"workers is {workers}, but the policy exists in this process only; put its class "
                "into a module that can be imported, or leave workers out."
            )
        workers = 0
    executor = choose_executor(workers, plan.attempts.episode_timeout_s)
    shown = ConsoleReporter(progress_console(stderr=True)) if progress else None
    with shown or contextlib.nullcontext():
        if shown is not None and here:
            shown.warn(
                f"No other process has {', '.join(here)}: all episodes are played in this one, one "
                "after the other."
            )
        run_plan(plan, folder, episode_runner(plan, folder), executor, reporter=shown)
    return folder


def _named(policies: AnyPolicies) -> list[PolicyRef]:
    if isinstance(policies, Mapping):
        return [policy_of(policy, name) for name, policy in policies.items()]
    given = policies if isinstance(policies, (list, tuple)) else [policies]
    found = [policy_of(policy) for policy in given]
    names = [one.name for one in found]
    if len(set(names)) < len(names):
        raise InvalidValueError(
            f"Two policies have the same name ({', '.join(names)}); give a mapping from names of "
            "your own to policies."
        )
    return found


def _new_folder() -> Path:
    moment = dt.datetime.now().astimezone().strftime("%Y-%m-%d-%H%M%S")
    number = 1
    while (folder := RUNS / (moment if number == 1 else f"{moment}-{number}")).exists():
        number += 1
    return folder
