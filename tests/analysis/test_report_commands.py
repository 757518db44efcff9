"""The commands `tables` and `compare` on real folders of records."""

from __future__ import annotations

from pathlib import Path

import pytest
import typer
from made_records import make_record
from typer.testing import CliRunner

from roboirg.cli.report_commands import compare, figures, tables
from roboirg.core.errors import InvalidValueError, UnknownNameError
from roboirg.evaluation.plan.plan_maker import make_plan
from roboirg.evaluation.plan.stored_plans import write_plan
from roboirg.evaluation.records.record_codec import StoreError
from roboirg.evaluation.records.store import RecordStore

app = typer.Typer()
app.command()(tables)
app.command()(compare)
app.command()(figures)


def write_run(folder: Path, policies: tuple[str, ...], leave_out: int = 0) -> None:
    """The listener succeeds always, others in explicit only; the last episodes are not played."""
    plan = make_plan(
        policies, tasks="PickXtimes,StopCube", settings="explicit,direct", episodes="8"
    )
    with RecordStore(folder) as store:
        jobs = plan.jobs()
        for job in jobs[: len(jobs) - leave_out]:
            won = job.policy == "listener" or job.setting == "explicit"
            store.append(make_record(job, *(("success",) if won else ("failure", "wrong"))))
    write_plan(plan, folder)


@pytest.fixture(scope="module")
def run(tmp_path_factory) -> Path:
    folder = tmp_path_factory.mktemp("runs") / "both"
    write_run(folder, ("listener", "forgetful"))
    return folder


def call(*words: object) -> str:
    outcome = CliRunner().invoke(app, [str(word) for word in words], catch_exceptions=False)
    assert outcome.exit_code == 0, outcome.output
    return outcome.output


def test_tables_are_printed(run: Path) -> None:
    output = call("tables", run)
    assert "Success by task and setting" in output
    assert "100.00 →" in output
    assert "0.00 ↓" in output
    assert "Stages of the contextual" not in output
    assert "RoboIRGBench" not in output  # of the paper's survey
    assert "Reference Avg" not in output  # nothing of this suite was played


@pytest.mark.parametrize(
    ("name", "suffix"), [("terminal", "txt"), ("markdown", "md"), ("latex", "tex"), ("csv", "csv")]
)
def test_tables_are_written(run: Path, tmp_path: Path, name: str, suffix: str) -> None:
    out = tmp_path / "new" / "tables"
    printed = call("tables", run, "--format", name, "--out", out, "--published")
    files = sorted(path.name for path in out.iterdir())
    assert files == [
        f"{key}.{suffix}" for key in ("context", "coverage", "main", "planner", "real")
    ]
    assert str(out / f"main.{suffix}") in printed
    assert "29.11" in (out / f"context.{suffix}").read_text()


def test_a_missing_run_is_named_without_its_policy(run: Path) -> None:
    with pytest.raises(StoreError, match="no records in nowhere;"):
        call("compare", "nowhere:other", run)


def test_floors_are_explained_below_the_table(run: Path) -> None:
    output = call("tables", run, "--which", "main", "--floors", "chance")
    assert "union: for each value the better" in " ".join(output.split())


def test_published_tables_need_no_run() -> None:
    assert "51.34" in call("tables", "--which", "planner", "--published", "--format", "markdown")
    assert call("tables", "--which", "coverage", "--format", "csv").startswith("table,source")
    for words in ((), ("--which", "main")):
        with pytest.raises(InvalidValueError, match="Tables need a run"):
            call("tables", *words)
    with pytest.raises(UnknownNameError, match="Did you mean 'planner'"):
        call("tables", "--which", "planer")
    with pytest.raises(UnknownNameError, match="There is no format 'pdf'"):
        call("tables", "--format", "pdf")


def test_tables_of_runs_alone(run: Path, tmp_path: Path) -> None:
    failures = call("tables", run, "--which", "failures", "--format", "csv")
    assert 'failures,ours,"forgetful (privileged), direct",all tasks,failures,no,,16,' in failures
    with pytest.raises(InvalidValueError, match="excludes --published"):
        call("tables", run, "--which", "failures", "--published")
    with pytest.raises(InvalidValueError, match="The table 'forms' needs a run"):
        call("tables", "--which", "forms")
    with pytest.raises(InvalidValueError, match="--forms implicit,resolved"):
        call("tables", run, "--which", "forms")
    assert "gaps.png" in call("figures", "--published", "--out", tmp_path, "--which", "gaps")
    with pytest.raises(InvalidValueError, match="Figures need a run"):
        call("figures", "--out", tmp_path)
    with pytest.raises(
        InvalidValueError, match="The paper's tables have nothing to draw for forms"
    ):
        call("figures", "--published", "--out", tmp_path, "--which", "forms")


def test_what_the_run_lacks_is_said(run: Path, tmp_path: Path) -> None:
    write_run(tmp_path / "part", ("listener",), leave_out=3)
    output = call("tables", tmp_path / "part", "--which", "main", "--format", "markdown")
    assert "100.00 …" in output
    assert "3 trials of the plan are still to be played" in output
    with pytest.raises(InvalidValueError, match="no results for the table 'real'"):
        call("tables", run, "--which", "real")
    with pytest.raises(StoreError, match="no records in"):
        call("tables", tmp_path)
    (tmp_path / "file").write_text("")
    with pytest.raises(InvalidValueError, match="Cannot write"):
        call("tables", run, "--out", tmp_path / "file")


def test_two_policies_of_a_run_are_compared(run: Path) -> None:
    output = call("compare", f"{run}:listener", f"{run}:forgetful")
    assert "direct: listener (privileged) is better, +100.0 points" in output
    assert "explicit: no clear difference" in output
    assert call("compare", f"{run}:listener", f"{run}:forgetful") == output
    with pytest.raises(UnknownNameError, match="Did you mean 'listener'"):
        call("compare", f"{run}:listner", f"{run}:forgetful")
    with pytest.raises(InvalidValueError, match="name one as RUN:listener"):
        call("compare", run, f"{run}:forgetful")


def test_two_runs_of_a_policy_are_told_apart_by_their_folders(run: Path, tmp_path: Path) -> None:
    write_run(tmp_path / "again", ("listener",), leave_out=3)
    output = call("compare", tmp_path / "again", f"{run}:listener")
    assert f"listener (privileged) ({tmp_path / 'again'}) against" in " ".join(output.split())
    assert "Incomplete: 3 trials" in output
    with pytest.raises(StoreError, match="no records in"):
        call("compare", tmp_path / "nowhere", run)
