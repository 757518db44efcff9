"""Control arms in plans, records, resumed and merged runs, and verification."""

import shutil

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


def plan_with_arms(arms, *, tasks="PickXtimes,VideoRepick", settings="direct"):
    """Return a plan of the test episodes 0, 1 and 2 of tasks, in control arms.

    An arm is a way to tell an episode: *told* as it is, with another goal (*other-goal*), in
    silence, ...
    """
    return make_plan(["oracle"], arms=arms, tasks=tasks, settings=settings, episodes="3")


def test_each_arm_of_an_episode_is_a_job_of_its_own():
    """No two jobs share the key of a record, or the name (`slug`) of the episode's files."""
    jobs = plan_with_arms("told,other-goal,silent,silent-empty,scrambled,paraphrase:3,again").jobs()

    assert len({identity_key(job) for job in jobs}) == len(jobs)
    assert len({job.slug for job in jobs}) == len(jobs)


def test_a_scene_without_a_second_goal_lacks_the_arm_other_goal_and_is_counted_as_left_out():
    """The test episodes 0 and 1 of PickXtimes have one cube, so that no other can be picked up;
    episode 2 has cubes of three colors.
    """
    plan = plan_with_arms("told,other-goal", tasks="PickXtimes")

    jobs = plan.jobs()

    assert [job.episode for job in jobs if job.arm == "other-goal"] == [2]
    assert plan.left_out(jobs) == {"other-goal": 2}


def test_explicit_episodes_lack_a_second_paraphrase():
    """Explicit instructions have one paraphrase only, so all six episodes lack the second."""
    plan = plan_with_arms("told,paraphrase:2", settings="explicit")

    assert plan.left_out(plan.jobs()) == {"paraphrase-2": 6}


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


@pytest.fixture(scope="module")
def run_with_other_goals(tmp_path_factory):
    """A run of the listener, which does what it hears, and of `habit`, which does the original goal
    whatever it hears: test episode 1 of StopCube, told as it is, with another goal, or in silence.
    """
    from roboirg.runs.play.rollout import EpisodeRunner

    folder = tmp_path_factory.mktemp("run")
    plan = make_plan(
        ["listener", "habit"], tasks="StopCube", settings="direct", episodes="1,",
        arms="told,other-goal,silent",
    )  # fmt: skip
    write_plan(plan, folder)
    run_plan(plan, folder, EpisodeRunner(folder, plan=plan.fingerprint), InProcess())
    return folder


@pytest.fixture
def records(run_with_other_goals):
    """The records of that run, by policy and arm."""
    return {(record.policy, record.arm): record for record in read_records(run_with_other_goals)}


@pytest.mark.sim
def test_an_episode_is_a_success_exactly_if_the_goal_that_was_stated_is_reached(records):
    """The run has two policies, of which one does what it hears, and three arms: six records. A
    record has the goal that was stated and those that were reached.
    """
    assert len(records) == 6
    for key, record in records.items():
        is_reached = record.goals.stated in record.goals.reached
        assert (record.outcome == "success") == is_reached, key


@pytest.mark.sim
def test_a_policy_that_does_what_it_hears_succeeds_at_another_goal(records):
    """The listener was told another goal than the episode's, and did that."""
    assert records["listener", "other-goal"].outcome == "success"


@pytest.mark.sim
def test_a_policy_that_does_the_original_goal_although_told_another_one_fails(records):
    """`habit` does so; that it would have succeeded at the original goal is recorded as well. Told
    the original goal itself, it has no second verdict.
    """
    record = records["habit", "other-goal"]

    assert record.outcome == "failure"
    assert record.goals.original == "success"
    assert record.attribution.failure == "other_goal"
    assert records["habit", "told"].goals.original is None


@pytest.mark.sim
def test_a_silent_episode_is_told_nothing_about_its_goal(records):
    assert records["listener", "silent"].instruction[0].text == "Please do your task."


@pytest.mark.sim
def test_verifying_a_run_plays_other_goals_again_and_finds_a_forged_record(
    run_with_other_goals, tmp_path
):
    """In a copy of the run one record is forged: `habit`, told another goal, did the original one,
    and its record now says that it failed at this.

    Its actions, played again, show otherwise. All other records hold.
    """
    from roboirg.apps.leaderboard.run_verification import verify_run

    run = shutil.copytree(run_with_other_goals, tmp_path / "run")
    records = (run / RECORDS_FILE).read_text()
    assert records.count('"original":"success"') == 1
    forged = records.replace('"original":"success"', '"original":"failure"')
    (run / RECORDS_FILE).write_text(forged)

    (check,) = verify_run(run).checks

    assert "goals: the record says" in check.findings[0]
