"""A run, its pack, its tables and its export as they were written with records of schema 3."""

from __future__ import annotations

import json
import zipfile
from pathlib import Path

import pandas as pd
import pytest
from typer.testing import CliRunner

from roboirg.apps.leaderboard.packing import MANIFEST
from roboirg.evaluation.plan.stored_plans import read_earlier_plans, read_plan
from roboirg.evaluation.records.record_codec import harder_setting, identity_key
from roboirg.evaluation.records.store import RECORDS_FILE, read_index
from roboirg.evaluation.run import runner
from roboirg.main import app

STORED = Path(__file__).parent / "schema_3"


@pytest.fixture
def run(tmp_path: Path) -> Path:
    """The folder: four commands with rivals, open reasoning, turns, stages, pools and two forms."""
    folder = tmp_path / "run"
    with zipfile.ZipFile(STORED / "run.zip") as archive:
        archive.extractall(folder, [one for one in archive.namelist() if one != MANIFEST])
    lines = (folder / RECORDS_FILE).read_text().splitlines()
    assert {json.loads(line)["schema_version"] for line in lines} == {3}
    return folder


LANGUAGE_OF_RUN = "2.0.0"
"""The language of that run; a later one has other words."""


def command(*words: str) -> str:
    result = CliRunner().invoke(app, words, catch_exceptions=False)
    assert result.exit_code == 0, result.output
    return result.output


def test_every_episode_of_its_plans_is_there(run: Path) -> None:
    newest = read_plan(run)
    assert newest is not None
    plans = (newest, *read_earlier_plans(run))
    jobs = {identity_key(job) for plan in plans for job in plan.jobs()}
    assert len(plans) == 5
    assert jobs == read_index(run).keys()


def test_it_resumes_with_no_episode_played_again(
    run: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(runner._OUR_VERSIONS, "language", LANGUAGE_OF_RUN)
    before = (run / RECORDS_FILE).read_bytes()
    command("run", "--plan", str(run / "plan.json"), "--out", str(run), "--workers", "0")
    assert (run / RECORDS_FILE).read_bytes() == before


@pytest.mark.sim
def test_its_pack_is_read_and_only_its_language_is_another(run: Path) -> None:
    for given in (run, STORED / "run.zip"):
        result = CliRunner().invoke(app, ["leaderboard", "verify", str(given)])
        assert result.exit_code == 2
        text = " ".join(result.output.split())
        named = f"language_version: the record says {LANGUAGE_OF_RUN}"
        assert text.count(named) == text.count("does not hold:") > 10
        assert "33 things do not hold." in text


OTHER = {"planner", "harder", "coverage", "table"}
"""Tables that were laid out or printed in another way then, and the head of each."""


def rows_of(table: str) -> list[str]:
    """The rows of the tables that are printed as then."""
    return [line for line in table.splitlines() if line and line.split(",")[0] not in OTHER]


def test_its_tables_are_equal(run: Path) -> None:
    now = command("tables", str(run), "--format", "csv")
    assert rows_of(now) == rows_of((STORED / "tables.csv").read_text())


def test_its_export_is_equal(run: Path, tmp_path: Path) -> None:
    """But for the settings that were options, and their notes."""
    command("records", "export", str(run), "--out", str(tmp_path / "records.parquet"))
    now = pd.read_parquet(tmp_path / "records.parquet")
    then = pd.read_parquet(STORED / "records.parquet")
    changed = ["schema_version", "setting", "metadata"]
    assert set(now.columns) - set(then.columns) == {
        "arm",
        "calls",
        "goals",
        "inference",
        "needs",
        "robot",
        "subgoals",
    }
    for stored, read in zip(then.to_dict("records"), now.to_dict("records"), strict=True):
        options = {"rival": stored["rival"], "reasoning": stored["reasoning"]}
        assert harder_setting(stored["setting"], **options) == read["setting"]
        before = json.loads(stored["metadata"])
        assert before.pop("reasoning") in (None, stored["reasoning"])
        assert json.loads(read["metadata"]) == before
    columns = [name for name in then.columns if name not in (*changed, "rival", "reasoning")]
    pd.testing.assert_frame_equal(now[columns], then[columns])
