"""Control arms in plans, records, resumed and merged runs, and verification."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from evaluation_fakes import FakePlay
from typer.testing import CliRunner

from roboirg.core.errors import InvalidValueError, UnknownNameError
from roboirg.evaluation.plan.plan import Plan
from roboirg.evaluation.plan.plan_file import read_plan_file
from roboirg.evaluation.plan.plan_maker import make_plan
from roboirg.evaluation.plan.stored_plans import read_plan, write_plan
from roboirg.evaluation.records.record_codec import identity_key
from roboirg.evaluation.records.store import RECORDS_FILE, read_records
from roboirg.evaluation.run.executor import InProcess
from roboirg.evaluation.run.runner import run_plan
from roboirg.main import app

ARMS = "told,other-goal,silent,silent-empty,scrambled,paraphrase:3,again"


def plan_of(arms: str = ARMS, **changes: object) -> Plan:
    fields = {"tasks": "PickXtimes,VideoRepick", "settings": "direct", "episodes": "3", **changes}
    return make_plan(["oracle"], arms=arms, **fields)  # type: ignore[arg-type]


def play(plan: Plan, folder: Path) -> Path:
    folder.mkdir(exist_ok=True)
    write_plan(plan, folder)
    run_plan(plan, folder, FakePlay(), InProcess())
    return folder


def test_what_has_no_other_goal_is_left_out_and_counted() -> None:
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
    explicit = plan_of("told,paraphrase:3", settings="explicit")
    assert explicit.left_out(explicit.jobs()) == {"paraphrase-3": 6}


def test_arms_of_the_command_line_and_of_plan_files(tmp_path: Path) -> None:
    path = tmp_path / "arms.yaml"
    path.write_text("policies: oracle\ntasks: StopCube\narms: [told, paraphrase:2, again]\n")
    fields = read_plan_file(str(path))
    made = make_plan(fields.pop("policies"), **fields)
    assert made.arms == ("told", "paraphrase-1", "paraphrase-2", "again")
    write_plan(made, tmp_path)
    assert read_plan(tmp_path) == made
    assert make_plan(["oracle"], tasks="StopCube").arms == ("told",)
    with pytest.raises(UnknownNameError, match="'silend'; known"):
        plan_of("told,silend")
    with pytest.raises(InvalidValueError, match="arm"):
        plan_of(",")
    result = CliRunner().invoke(
        app, ["run", "--policy", "oracle", "--tasks", "VideoRepick", "--arms", "told,other-goal",
              "--episodes", "2", "--settings", "direct", "--out", str(tmp_path / "x"), "--dry-run"]
    )  # fmt: skip
    assert "other-goal: 2 episodes left out." in result.output, result.output


def test_a_run_resumes_with_more_arms(tmp_path: Path) -> None:
    play(plan_of("told"), tmp_path)
    stored = (tmp_path / RECORDS_FILE).read_bytes()
    play(plan_of(), tmp_path)
    grown = (tmp_path / RECORDS_FILE).read_bytes()
    assert grown.startswith(stored)
    assert {identity_key(one) for one in read_records(tmp_path)} == {
        identity_key(job) for job in plan_of().jobs()
    }
    play(plan_of(), tmp_path)
    assert (tmp_path / RECORDS_FILE).read_bytes() == grown


@pytest.mark.sim
def test_runs_with_arms_are_verified_and_forged_goals_are_found(tmp_path: Path) -> None:
    from roboirg.apps.leaderboard.run_verification import verify_run
    from roboirg.evaluation.play.rollout import EpisodeRunner

    plan = make_plan(
        ["listener", "habit"], tasks="StopCube", settings="direct", episodes="1,",
        arms="told,other-goal,silent",
    )  # fmt: skip
    write_plan(plan, tmp_path)
    run_plan(plan, tmp_path, EpisodeRunner(tmp_path, plan=plan.fingerprint), InProcess())
    records = {(one.policy, one.arm): one for one in read_records(tmp_path)}
    for (policy, arm), record in records.items():
        goals = record.goals
        assert goals is not None
        assert (record.outcome == "success") == (goals.stated in goals.reached), (policy, arm)
    told, other = records["habit", "told"].goals, records["habit", "other-goal"].goals
    assert told is not None
    assert other is not None
    assert (other.original, told.original) == ("success", None)
    assert told.stated in other.reached
    why = records["habit", "other-goal"].attribution
    assert why is not None
    assert (why.kind, why.failure) == ("grounding", "other_goal")
    assert "ollowed the other goal" in why.sentence
    assert records["listener", "other-goal"].outcome == "success"
    assert records["listener", "silent"].instruction[0].text == "Please do your task."
    lines = (tmp_path / RECORDS_FILE).read_text().splitlines()
    forged = [json.loads(line) for line in lines]
    for one in forged:
        if one["arm"] == "other-goal" and one["policy"] == "habit":
            one["goals"]["original"] = "failure"
    (tmp_path / RECORDS_FILE).write_text("".join(json.dumps(one) + "\n" for one in forged))
    (check,) = verify_run(tmp_path).checks  # the others hold
    assert "goals: the record says" in check.findings[0]
