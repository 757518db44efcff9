"""Control arms in plans, records, resumed and merged runs, and verification."""

import json

import pytest
from page_text import call

from roboirg.core.errors import InvalidValueError, UnknownNameError
from roboirg.records.record_codec import identity_key
from roboirg.records.store import RECORDS_FILE, read_records
from roboirg.runs.plan.plan_file import read_plan_file
from roboirg.runs.plan.plan_maker import make_plan
from roboirg.runs.plan.stored_plans import write_plan
from roboirg.runs.run.executor import InProcess
from roboirg.runs.run.runner import run_plan

ALL_ARMS = "told,other-goal,silent,silent-empty,scrambled,paraphrase:3,again"


def plan_with_arms(arms=ALL_ARMS, **changes):
    """Return a plan of three episodes of two tasks, each told in several ways, its arms."""
    fields = {"tasks": "PickXtimes,VideoRepick", "settings": "direct", "episodes": "3", **changes}
    return make_plan(["oracle"], arms=arms, **fields)


def test_each_arm_of_an_episode_is_a_job_of_its_own():
    """An arm is a way to tell an episode: as it is, with another goal, in silence, ..."""
    jobs = plan_with_arms().jobs()

    assert len({identity_key(job) for job in jobs}) == len(jobs)
    assert len({job.slug for job in jobs}) == len(jobs)


def test_a_scene_without_a_second_goal_lacks_the_arm_other_goal_and_is_counted_as_left_out():
    """VideoRepick has no other goal in three episodes, nor has PickXtimes in two with one cube."""
    plan = plan_with_arms()
    jobs = plan.jobs()

    repick = {job.arm for job in jobs if job.task == "VideoRepick" and job.episode == 0}

    assert repick == set(plan.arms) - {"other-goal"}
    assert plan.left_out(jobs) == {"other-goal": 5}


@pytest.mark.parametrize(
    ("arms", "settings", "left_out"),
    [
        ("told", "direct", {}),
        # Explicit instructions have one paraphrase only: all six episodes lack the second.
        ("told,paraphrase:2", "explicit", {"paraphrase-2": 6}),
    ],
)
def test_arms_that_an_episode_lacks_are_counted(arms, settings, left_out):
    plan = plan_with_arms(arms, settings=settings)

    assert plan.left_out(plan.jobs()) == left_out


def test_arms_are_read_from_plan_files_and_from_the_command_line(tmp_path):
    """paraphrase:2 stands for two arms; without a word on arms there is *told* alone."""
    path = tmp_path / "arms.yaml"
    path.write_text("policies: oracle\ntasks: StopCube\narms: [told, paraphrase:2, again]\n")

    fields = read_plan_file(str(path))
    made = make_plan(fields.pop("policies"), **fields)

    assert made.arms == ("told", "paraphrase-1", "paraphrase-2", "again")
    assert make_plan(["oracle"], tasks="StopCube").arms == ("told",)


@pytest.mark.parametrize(
    ("arms", "error", "words"),
    [("told,silend", UnknownNameError, "'silend'; known"), (",", InvalidValueError, "arm")],
)
def test_unknown_arms_and_none_at_all_are_refused(arms, error, words):
    with pytest.raises(error, match=words):
        plan_with_arms(arms)


def test_a_dry_run_prints_how_many_episodes_lack_an_arm(tmp_path):
    """Scenes of VideoRepick have no second goal, which the arm other-goal would state."""
    printed = call(
        "run", "--policy", "oracle", "--tasks", "VideoRepick", "--arms", "told,other-goal",
        "--episodes", "2", "--settings", "direct", "--out", tmp_path / "x", "--dry-run",
    )  # fmt: skip

    assert "other-goal: 2 episodes left out." in printed


@pytest.mark.sim
def test_verifying_a_run_plays_other_goals_again_and_finds_a_forged_record(tmp_path):
    """The listener does what it hears; `habit` does the original goal, whatever it hears.

    In a record of `habit` *original: success* is replaced by *failure*.
    """
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
