"""Runs with a task, a setting and a policy of packages that are not installed here."""

from __future__ import annotations

from pathlib import Path

import pytest
from msgspec.structs import replace
from page_text import call
from run_fakes import FakePlay, small_plan

from roboirg.records.store import RecordStore

NAMES_OF_AN_ABSENT_PACKAGE = {
    "PickXtimes": "TheirTask",
    "direct": "theirs",
    "random": "their_package:Policy",
}


@pytest.fixture
def run_of_absent_package(tmp_path: Path) -> Path:
    """A run as it would look if another package had brought its task, setting and policy."""
    plan = small_plan(3)
    with RecordStore(tmp_path) as store:
        for job in plan.jobs()[:-1]:
            record = FakePlay()(job)
            theirs = {
                name: NAMES_OF_AN_ABSENT_PACKAGE.get(value, value)
                for name, value in (("task", record.task), ("policy", record.policy))
            }
            setting = NAMES_OF_AN_ABSENT_PACKAGE.get(record.setting, record.setting)
            store.append(replace(record.with_options(setting=setting), **theirs))
    text = plan.model_dump_json()
    for ours, theirs in NAMES_OF_AN_ABSENT_PACKAGE.items():
        text = text.replace(f'"{ours}"', f'"{theirs}"')
    (tmp_path / "plan.json").write_text(text)
    return tmp_path


def test_a_run_of_a_package_that_is_not_installed_has_tables_and_a_page(run_of_absent_package):
    """Someone else's run is shown, with a warning; would find that names must be known here."""
    tables = " ".join(call("tables", run_of_absent_package, "--which", "other").split())
    call("report", run_of_absent_package)

    assert "TheirTask" in tables
    assert "their_package:Policy" in tables
    assert (
        "The package with TheirTask is not installed: what its runs lack is not counted." in tables
    )

    page = (run_of_absent_package / "report.html").read_text()
    for name in ("TheirTask", "theirs", "their_package:Policy"):
        assert name in page
