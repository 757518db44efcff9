"""Runs of invented results, for tests of the board."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from msgspec.structs import replace

from roboirg.core.instruction_options import InstructionOptions
from roboirg.evaluation.plan.plan_file import read_plan_file
from roboirg.evaluation.plan.plan_maker import make_plan
from roboirg.evaluation.plan.stored_plans import write_plan
from roboirg.evaluation.play.rollout_result import RolloutResult, make_record
from roboirg.evaluation.records.record import Job, Record
from roboirg.evaluation.records.store import RecordStore
from roboirg.language.settings import EXPLICIT


def record(
    policy: str,
    task: str,
    episode: int,
    *,
    won: bool,
    privileged: bool = False,
    split: str = "test",
) -> Record:
    result = RolloutResult(outcome="success" if won else "failure")
    result.cause = None if won else "it failed"
    job = Job(
        policy=policy, task=task, split=split, episode=episode, options=InstructionOptions(EXPLICIT)
    )
    made = make_record(job, result, started_at="")
    return replace(made, privileged=privileged, attribution=None)


def store(folder: Path, results: list[Record]) -> Path:
    with RecordStore(folder) as records:
        for one in results:
            records.append(one)
    return folder


def whole_run(folder: Path, **changes: Any) -> Path:
    """Store a whole run of the plan `challenge`, in which every seventh episode is an error."""
    plan = make_plan(["random"], **(read_plan_file("challenge") | changes))
    folder.mkdir()
    write_plan(plan, folder)
    made = []
    for number, job in enumerate(plan.jobs()):
        outcome = "error" if number % 7 == 0 else "success"
        result = RolloutResult(outcome=outcome, error="policy")
        result.cause = None if outcome == "success" else "policy: it raised"
        made.append(make_record(job, result, started_at="", plan=plan.fingerprint))
    return store(folder, made)
