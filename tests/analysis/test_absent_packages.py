"""Runs with a task, a setting and a policy of packages that are not installed here."""

from __future__ import annotations

from pathlib import Path

import pytest
from msgspec.structs import replace
from page_text import call
from run_fakes import FakePlay, small_plan

from roboirg.records.store import RecordStore

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
    text = plan.model_dump_json()
    for ours, theirs in THEIRS.items():
        text = text.replace(f'"{ours}"', f'"{theirs}"')
    (tmp_path / "plan.json").write_text(text)
    return tmp_path


def test_its_tables_are_shown_and_its_page_is_made(run):
    shown = " ".join(call("tables", run, "--which", "other").split())
    warning = "The package with TheirTask is not installed: what its runs lack is not counted."
    call("report", run)

    page = (run / "report.html").read_text()

    for text, parts in ((shown, ("TheirTask", "their_package:Policy", warning)), (page, THEIRS)):
        assert [part for part in parts if THEIRS.get(part, part) not in text] == []
