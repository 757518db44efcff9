"""Processor time of verifying an episode."""

from __future__ import annotations

import functools
import time
from pathlib import Path

from benchmarks.engine_costs import temporary_folder
from roboirg.apps.leaderboard.run_verification import verify_run
from roboirg.runs.plan.plan_maker import make_plan
from roboirg.runs.play.rollout import EpisodeRunner
from roboirg.runs.run.executor import InProcess
from roboirg.runs.run.runner import run_plan


def verify_time() -> float:
    """Return seconds of processor time to verify an episode, the mean over policies and tasks."""
    folder, count = _played_run()
    start = time.process_time()
    found = verify_run(folder)
    if not found.holds or found.records != count:
        raise AssertionError(f"{found.records} records of {count} were checked: {found.checks}")
    return (time.process_time() - start) / count


@functools.cache
def _played_run() -> tuple[Path, int]:
    """Return a run of the oracle, and of a policy that mostly plays to the limit, on all tasks."""
    plan = make_plan(["oracle", "random"], settings="explicit", episodes="1")
    folder = temporary_folder()
    summary = run_plan(plan, folder, EpisodeRunner(folder, plan=plan.fingerprint), InProcess())
    return folder, summary.total
