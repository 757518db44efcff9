"""Runs with a task, a setting and a policy of packages that are not installed here."""

from __future__ import annotations

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
def run_of_absent_package(tmp_path):
    """A run as it would look if another package had brought its task, setting and policy.

    Of its six planned episodes, three explicit and three in the setting *theirs*, five are played.
    """
    plan = small_plan(3)
    with RecordStore(tmp_path) as store:
        for job in plan.jobs()[:-1]:
            record = FakePlay()(job)
            if record.setting == "direct":
                record = record.with_options(setting="theirs")
            store.append(replace(record, task="TheirTask", policy="their_package:Policy"))
    text = plan.model_dump_json()
    for ours, theirs in NAMES_OF_AN_ABSENT_PACKAGE.items():
        text = text.replace(f'"{ours}"', f'"{theirs}"')
    (tmp_path / "plan.json").write_text(text)
    return tmp_path


def test_a_run_of_a_package_that_is_not_installed_has_tables_with_a_warning(run_of_absent_package):
    """Someone else's run is shown; would find that a task or policy must be known here."""
    tables = " ".join(call("tables", run_of_absent_package, "--which", "other").split())

    assert "TheirTask" in tables
    assert "their_package:Policy" in tables
    assert (
        "The package with TheirTask is not installed: what its runs lack is not counted." in tables
    )


def test_a_run_of_a_package_that_is_not_installed_has_a_page(run_of_absent_package):
    """The run's task *TheirTask*, setting *theirs* and policy are not known on this machine."""
    call("report", run_of_absent_package)

    page = (run_of_absent_package / "report.html").read_text()
    assert "TheirTask" in page
    assert "theirs" in page
    assert "their_package:Policy" in page
