"""Runs with a task, a setting and a policy of packages that are not installed here."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from evaluation_fakes import FakePlay, small_plan
from msgspec.structs import replace
from page_text import call

from roboirg.evaluation.plan.plan import Plan
from roboirg.evaluation.records.store import RecordStore

THEIRS = {"PickXtimes": "TheirTask", "direct": "theirs", "random": "their_package:Policy"}


@pytest.fixture
def run(tmp_path: Path) -> Path:
    plan = small_plan(3)
    with RecordStore(tmp_path) as store:
        for job in plan.jobs()[:-1]:
            record = FakePlay()(job)
            theirs = {
                name: THEIRS.get(value, value)
                for name, value in (("task", record.task), ("policy", record.policy))
            }
            setting = THEIRS.get(record.setting, record.setting)
            store.append(replace(record.with_options(setting=setting), **theirs))
    _write_plan(plan, tmp_path)
    return tmp_path


def _write_plan(plan: Plan, folder: Path) -> None:
    text = json.dumps(json.loads(plan.model_dump_json()))
    for ours, theirs in THEIRS.items():
        text = text.replace(f'"{ours}"', f'"{theirs}"')
    (folder / "plan.json").write_text(text)


def test_its_tables_are_shown_and_its_page_is_made(run: Path) -> None:
    shown = " ".join(call("tables", run, "--which", "other").split())
    assert "TheirTask" in shown
    assert "their_package:Policy" in shown
    assert (
        "The package with TheirTask is not installed: what its runs lack is not counted." in shown
    )
    call("report", run)
    page = (run / "report.html").read_text()
    assert "TheirTask" in page
    assert "theirs" in page
