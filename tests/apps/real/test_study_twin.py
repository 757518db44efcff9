"""The trials of a study in simulation: planned by one command, played by the ordinary run."""

import csv

import pytest
from page_text import call

from roboirg.apps.real.study.study_plan import read_study
from roboirg.records.store import read_records

pytestmark = pytest.mark.sim


def plan_study(folder):
    """Plan one trial of each of the two default tasks, and return what the command prints.

    The policy has the name "mine"; it is the scripted listener, which reads the goal from the
    simulator and so solves both tasks.
    """
    policy = ("--policy", "mine=listener")
    size = ("--settings", "reasoning", "--trials", 1, "--demonstrations", 2)
    return call("real", "plan", *policy, *size, "--out", folder)


@pytest.fixture(scope="module")
def played_study(tmp_path_factory):
    """The folder of a study whose trials were played in simulation, with records in `twin`."""
    study = tmp_path_factory.mktemp("study")
    plan_study(study)
    for task in ("PutInBox", "PickByCount"):
        plan = study / f"twin-{task}.yaml"
        call("run", "--plan", plan, "--workers", 0, "--out", study / "twin")
    return study


def test_a_planned_study_has_a_plan_of_a_run_for_each_task(tmp_path):
    """The command names the plans, with which `roboirg run` plays the trials in simulation."""
    printed = plan_study(tmp_path)

    assert {path.name for path in tmp_path.iterdir()} == {
        "plan.json", "trials.csv", "demonstrations.csv", "sheet.html",
        "twin-PutInBox.yaml", "twin-PickByCount.yaml",
    }  # fmt: skip
    assert str(tmp_path / "twin-PickByCount.yaml") in printed


def test_run_plays_the_trials_of_a_study_in_simulation(played_study):
    """There are two trials, one of each task, and the policy solves both."""
    records = read_records(played_study / "twin")

    trials = read_study(played_study).trials
    assert {record.identity for record in records} == {trial.identity for trial in trials}
    assert [record.outcome for record in records] == ["success", "success"]


def test_tables_mark_what_was_played_in_simulation_instead_of_on_a_robot(played_study):
    """*twin* is a trial of a study in simulation, *privileged* a policy that reads the goal there.

    The table has a line for each of the two tasks, and one for their average.
    """
    table = call("tables", played_study / "twin", "--which", "real", "--format", "csv")

    names = {row["column"]: row["name"] for row in csv.DictReader(table.splitlines())}
    mine = "mine (privileged) (twin)"
    assert names == {"PutInBox": mine, "PickByCount": mine, "Avg": mine}
