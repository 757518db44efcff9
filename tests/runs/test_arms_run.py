"""Control arms in plans, records, resumed and merged runs, and verification."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from page_text import call
from run_fakes import fake_run

from roboirg.core.errors import InvalidValueError, UnknownNameError
from roboirg.records.record_codec import identity_key
from roboirg.records.store import RECORDS_FILE, read_records
from roboirg.runs.plan.plan import Plan
from roboirg.runs.plan.plan_file import read_plan_file
from roboirg.runs.plan.plan_maker import make_plan
from roboirg.runs.plan.stored_plans import write_plan
from roboirg.runs.run.executor import InProcess
from roboirg.runs.run.runner import run_plan

ARMS = "told,other-goal,silent,silent-empty,scrambled,paraphrase:3,again"


def plan_of(arms: str = ARMS, **changes: object) -> Plan:
    fields = {"tasks": "PickXtimes,VideoRepick", "settings": "direct", "episodes": "3", **changes}
    return make_plan(["oracle"], arms=arms, **fields)  # type: ignore[arg-type]


def play(plan: Plan, folder: Path) -> Path:
    folder.mkdir(exist_ok=True)
    write_plan(plan, folder)
    fake_run(folder, plan)
    return folder


def test_what_has_no_other_goal_is_left_out_and_counted():
    plan = plan_of()
    jobs = plan.jobs()
    assert len({identity_key(job) for job in jobs}) == len(jobs)
    assert len({job.slug for job in jobs}) == len(jobs)

    repick = [job.arm for job in jobs if job.task == "VideoRepick" and job.episode == 0]
    assert "other-goal" not in repick
    assert set(repick) == set(plan.arms) - {"other-goal"}
    # None in VideoRepick, nor in the scenes of PickXtimes that have one cube.
    assert plan.left_out(jobs) == {"other-goal": 5}
    assert plan_of("told").left_out(plan_of("told").jobs()) == {}

    explicit = plan_of("told,paraphrase:2", settings="explicit")
    assert explicit.left_out(explicit.jobs()) == {"paraphrase-2": 6}


def test_arms_of_the_command_line_and_of_plan_files(tmp_path):
    path = tmp_path / "arms.yaml"
    path.write_text("policies: oracle\ntasks: StopCube\narms: [told, paraphrase:2, again]\n")
    fields = read_plan_file(str(path))
    made = make_plan(fields.pop("policies"), **fields)

    assert made.arms == ("told", "paraphrase-1", "paraphrase-2", "again")
    assert make_plan(["oracle"], tasks="StopCube").arms == ("told",)
    with pytest.raises(UnknownNameError, match="'silend'; known"):
        plan_of("told,silend")
    with pytest.raises(InvalidValueError, match="arm"):
        plan_of(",")

    printed = call(
        "run", "--policy", "oracle", "--tasks", "VideoRepick", "--arms", "told,other-goal",
        "--episodes", "2", "--settings", "direct", "--out", tmp_path / "x", "--dry-run",
    )  # fmt: skip
    assert "other-goal: 2 episodes left out." in printed


@pytest.mark.sim
def test_runs_with_arms_are_verified_and_forged_goals_are_found(tmp_path):
    from roboirg.apps.leaderboard.run_verification import verify_run
    from roboirg.runs.play.rollout import EpisodeRunner

    plan = make_plan(
        ["listener", "habit"], tasks="StopCube", settings="direct", episodes="1,",
        arms="told,other-goal,silent",
    )  # fmt: skip
    write_plan(plan, tmp_path)
    run_plan(plan, tmp_path, EpisodeRunner(tmp_path, plan=plan.fingerprint), InProcess())

    records = {(record.policy, record.arm): record for record in read_records(tmp_path)}
    for (policy, arm), record in records.items():
        goals = record.goals
        assert (record.outcome == "success") == (goals.stated in goals.reached), (policy, arm)
    assert records["habit", "told"].goals.original is None
    assert records["habit", "other-goal"].goals.original == "success"
    assert records["habit", "other-goal"].attribution.failure == "other_goal"
    assert records["listener", "other-goal"].outcome == "success"
    assert records["listener", "silent"].instruction[0].text == "Please do your task."

    lines = []
    for line in (tmp_path / RECORDS_FILE).read_text().splitlines():
        row = json.loads(line)
        if row["arm"] == "other-goal" and row["policy"] == "habit":
            row["goals"]["original"] = "failure"
        lines.append(json.dumps(row) + "\n")
    (tmp_path / RECORDS_FILE).write_text("".join(lines))
    (check,) = verify_run(tmp_path).checks  # the others hold
    assert "goals: the record says" in check.findings[0]
