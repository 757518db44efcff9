"""The commands `tables`, `compare`, `figures` and `report` on real folders and packs."""

from __future__ import annotations

import json
import re
from pathlib import Path

import pytest
import typer
from made_records import make_record
from msgspec.structs import replace
from typer.testing import CliRunner

from roboirg.apps.leaderboard.packing import pack_run
from roboirg.cli.records_commands import merge
from roboirg.cli.report_commands import compare, figures, report, tables
from roboirg.core.errors import InvalidValueError, RoboIRGError, UnknownNameError
from roboirg.evaluation.plan.plan_maker import make_plan
from roboirg.evaluation.plan.stored_plans import write_plan
from roboirg.evaluation.records.record_codec import StoreError
from roboirg.evaluation.records.store import RecordStore

app = typer.Typer()
for command in (tables, compare, figures, report, merge):
    app.command()(command)


def write_run(
    folder: Path, policies: tuple[str, ...], leave_out: int = 0, device: str | None = None
) -> Path:
    """The listener succeeds always, others in explicit only; the last episodes are not played."""
    plan = make_plan(
        policies, tasks="PickXtimes,StopCube", settings="explicit,direct", episodes="8"
    )
    with RecordStore(folder) as store:
        jobs = plan.jobs()
        for job in jobs[: len(jobs) - leave_out]:
            won = job.policy == "listener" or job.setting == "explicit"
            record = make_record(job, *(("success",) if won else ("failure", "wrong")))
            store.append(replace(record, render_device=device))
    write_plan(plan, folder)
    return folder


@pytest.fixture(scope="module")
def run(tmp_path_factory) -> Path:
    return write_run(tmp_path_factory.mktemp("runs") / "folder-run", ("listener", "forgetful"))


@pytest.fixture(scope="module")
def pack(run: Path) -> Path:
    pack_run(run, path := run.parent / "shipped.roboirg.zip")
    return path


def call(*words: object) -> str:
    outcome = CliRunner().invoke(app, [str(word) for word in words], catch_exceptions=False)
    assert outcome.exit_code == 0, outcome.output
    return outcome.output


def test_tables_are_written(run: Path, tmp_path: Path) -> None:
    out = tmp_path / "new" / "tables"
    printed = call("tables", run, "--format", "latex", "--out", out, "--published").split()
    names = ["coverage.tex", "main.tex", "planner.tex", "context.tex", "real.tex"]
    assert sorted(printed) == sorted(map(str, out.iterdir())) == sorted(str(out / n) for n in names)
    call("tables", "--format", "latex", "--out", out, "--published", "--which", "context")
    call("figures", "--published", "--out", out, "--which", "gaps")
    assert "29.11" in (out / "context.tex").read_text()


def test_a_pack_is_read_like_the_folder_it_was_made_of(
    run: Path, pack: Path, tmp_path: Path
) -> None:
    for words in (
        ("tables", "--format", "csv"),
        ("tables", "--by", "difficulty", "--format", "json"),
        ("tables", "--which", "facts", "--format", "markdown"),
        ("tables", "--which", "failures", "--format", "markdown"),
    ):
        assert call(*words, pack) == call(*words, run).replace(str(run), str(pack))
    sides = call("compare", f"{pack}:listener", f"{run}:forgetful", "--by", "difficulty")
    assert sides == call("compare", f"{run}:listener", f"{pack}:forgetful", "--by", "difficulty")
    assert "direct: listener (privileged) is better, +100.0 points" in sides
    drawn = call("figures", pack, "--which", "gaps", "--out", tmp_path).splitlines()
    assert [Path(path).name for path in drawn][:2] == ["gaps.png", "gaps.svg"]


def test_a_page_is_written_next_to_a_pack_or_where_it_is_wanted(
    run: Path, pack: Path, tmp_path: Path
) -> None:
    pages = [run / "report.html", pack.parent / "shipped.html", tmp_path / "page.html"]
    for words in ((run,), (pack,), (f"{pack}:listener", "--against", run, "--out", pages[2])):
        call("report", *words)
    folder, packed, both = (page.read_text("utf-8") for page in pages)
    assert packed == folder.replace("folder-run", "shipped")
    assert "<title>shipped:listener against folder-run" in both
    with pytest.raises(InvalidValueError, match="--serve shows one run"):
        call("report", pack, "--serve", "--out", tmp_path / "x.html")


def test_policies_are_chosen_where_a_run_is_named(run: Path, pack: Path, tmp_path: Path) -> None:
    csv = ("--which", "main", "--format", "csv")
    whole = call("tables", run, *csv)
    (head, *rows), one = whole.splitlines(), call("tables", f"{run}:forgetful", *csv)
    assert one.splitlines() == [head, *(row for row in rows if "forgetful" in row)]
    assert call("tables", f"{run}:forgetful", f"{run}:listener", run, *csv) == whole
    other = call("tables", f"{run}:forgetful", f"{pack}:listener", *csv)
    assert sorted(other.splitlines()) == sorted(whole.splitlines())
    named = write_run(tmp_path / "a:b", ("listener", "forgetful"))
    (tmp_path / "a").mkdir()
    assert call("tables", f"{named}:forgetful", *csv) == one
    with pytest.raises(UnknownNameError, match="Did you mean 'listener'"):
        call("tables", f"{pack}:listner")


@pytest.mark.parametrize("name", ["nowhere", "nowhere:other"])
def test_a_missing_run_is_named_without_its_policy(run: Path, name: str) -> None:
    with pytest.raises(StoreError, match="There is no run at nowhere;"):
        call("compare", run, name)


def played_under(run: Path, folder: Path, **changes: object) -> Path:
    """Write the episodes of the forgetful listener twice, the second time changed."""
    with RecordStore(folder) as store:
        for line in (run / "records.jsonl").read_bytes().splitlines():
            record = json.loads(line)
            if record["policy"] == "forgetful":
                store.extend([line, json.dumps(record | changes).encode()])
    write_plan(make_plan(("forgetful",), tasks="PickXtimes", episodes="8"), folder)
    return folder


def test_tables_failures_and_page_show_the_same_policy_runs(run: Path, tmp_path: Path) -> None:
    folder = played_under(run, tmp_path / "steps", environment={"max_steps": 40})
    output = call("report", folder)
    labels = [f"forgetful, max steps {steps} (privileged)" for steps in (1300, 40)]
    for label in labels:
        assert f"{label}\n" in output
        assert f"\n{label}: 16 episodes without success\n" in output
        assert label in (folder / "report.html").read_text()
    assert output.count("episodes without success") == 2


def test_mixed_render_devices_are_named(run: Path, tmp_path: Path) -> None:
    devices = ("llvmpipe", "NVIDIA H100")
    runs = [
        write_run(tmp_path / name, (name,), device=device)
        for name, device in zip(("listener", "forgetful"), devices, strict=True)
    ]
    merged = tmp_path / "merged"
    for words in (
        ("merge", *runs, "--out", merged),
        ("tables", merged),
        ("tables", *runs),
        ("compare", *runs),
        ("report", merged),
    ):
        assert "Mixed render devices: NVIDIA H100, llvmpipe. Their pictures" in call(*words)
    for words in (("tables", runs[0], run), ("report", runs[0])):
        assert "Mixed" not in call(*words)


@pytest.mark.parametrize(
    ("words", "says"),
    [
        ("tables", "Tables need a run"),
        ("tables --which main", "Tables need a run"),
        ("tables --which forms", "Tables need a run"),
        ("tables --by all", "Tables need a run"),
        ("tables RUN --which planer", "Did you mean 'planner'"),
        ("tables --format pdf", "There is no format 'pdf'"),
        ("tables RUN --which failures --published", "show runs alone"),
        ("tables RUN --by pattern --which main", "show runs alone"),
        ("tables RUN --which forms", "--forms implicit,resolved"),
        ("tables RUN --which real", "no results for the table 'real'"),
        ("tables EMPTY", "no records in"),
        ("tables FILE", "is not a packed run"),
        ("tables RUN --out FILE", "Cannot write"),
        ("figures --out EMPTY", "Figures need a run"),
        ("figures --published --out EMPTY --which forms", "The paper's tables have nothing to"),
        ("compare RUN RUN:forgetful", "name one as RUN:listener"),
        ("report EMPTY", "no records in"),
    ],
)
def test_what_cannot_be_shown_is_one_sentence(
    run: Path, tmp_path: Path, words: str, says: str
) -> None:
    (tmp_path / "file").write_text("")
    places = {"RUN": str(run), "EMPTY": str(tmp_path), "FILE": str(tmp_path / "file")}
    for name, place in places.items():
        words = re.sub(rf"\b{name}\b", place, words)
    with pytest.raises(RoboIRGError, match=says):
        call(*words.split())


def test_an_incomplete_run_is_named_next_to_a_whole_one(run: Path, tmp_path: Path) -> None:
    part = write_run(tmp_path / "part", ("listener",), leave_out=3)
    assert "100.00 …" in call("tables", part, "--which", "main", "--format", "markdown")
    output = " ".join(call("compare", part, f"{run}:listener").split())
    assert f"listener (privileged) ({part}) against" in output
    assert "Incomplete: 3 trials" in output
