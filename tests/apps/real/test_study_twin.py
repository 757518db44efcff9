"""The trials of a study in simulation: planned by one command, played by the ordinary run."""

import pytest
from typer.testing import CliRunner

from roboirg.apps.real.study.study_plan import read_study
from roboirg.main import app
from roboirg.records.store import read_records

pytestmark = pytest.mark.sim


def test_run_plays_the_trials_of_a_study(tmp_path):
    """A study with one trial of each of two tasks is planned; `run` plays both plans of its twin.

    Records are those of the study's trials. The policy is a listener by the name "mine", which
    reads the goal from the simulator and solves both tasks.
    """

    def call(*words):
        done = CliRunner().invoke(app, [*map(str, words)])
        assert done.exit_code == 0, done.output
        return done.output

    study = tmp_path / "study"
    twin = tmp_path / "study" / "twin"
    said = ("--settings", "reasoning", "--trials", 1, "--demonstrations", 2)
    printed = call("real", "plan", "--policy", "mine=listener", *said, "--out", study)

    assert {path.name for path in study.iterdir()} == {
        "plan.json", "trials.csv", "demonstrations.csv", "sheet.html",
        "twin-PutInBox.yaml", "twin-PickByCount.yaml",
    }  # fmt: skip
    assert str(study / "twin-PickByCount.yaml") in printed

    for task in ("PutInBox", "PickByCount"):
        call("run", "--plan", study / f"twin-{task}.yaml", "--workers", 0, "--out", twin)
    records = read_records(twin)
    assert {record.identity for record in records} == {
        record.identity for record in read_study(study).trials
    }
    assert [record.outcome for record in records] == ["success"] * 2

    table = call("tables", twin, "--which", "real", "--format", "csv")
    assert table.count("mine (privileged) (twin)") == 3  # two tasks and their average
