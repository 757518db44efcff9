"""The commands `tables`, `compare`, `figures` and `report` on real folders and packs."""

from __future__ import annotations

import io
import re
from pathlib import Path

import pytest
from msgspec.structs import replace
from page_text import call, played, store

from roboirg.apps.leaderboard.packing import pack_run
from roboirg.core.errors import RoboIRGError
from roboirg.runs.plan.plan_maker import make_plan


def write_run(folder, policies, device=None):
    """Write the records of 8 episodes of two tasks in two settings, and return the folder.

    The listener wins all, others explicit episodes alone.
    """
    plan = make_plan(
        policies, tasks="PickXtimes,StopCube", settings="explicit,direct", episodes="8"
    )
    found = [replace(record, render_device=device) for record in played(plan)]
    return store(folder, found, plan).folder


@pytest.fixture(scope="module")
def run_of_two_policies(tmp_path_factory):
    return write_run(tmp_path_factory.mktemp("runs") / "folder-run", ("listener", "forgetful"))


@pytest.fixture(scope="module")
def pack_of_the_run(run_of_two_policies):
    pack_run(run_of_two_policies, path := run_of_two_policies.parent / "shipped.roboirg.zip")
    return path


def test_tables_out_writes_a_file_for_each_table_into_a_new_folder(run_of_two_policies, tmp_path):
    """And prints their paths."""
    out = tmp_path / "new" / "tables"

    printed = call(
        "tables", run_of_two_policies, "--format", "latex", "--out", out, "--published"
    ).split()

    names = {path.name for path in out.iterdir()}
    assert names == {"coverage.tex", "main.tex", "planner.tex", "context.tex", "real.tex"}
    assert sorted(printed) == sorted(map(str, out.iterdir()))


def test_published_tables_need_no_run(tmp_path):
    """29.11 is a rate of the paper's table of contexts; our row stands in that of benchmarks."""
    words = ("--format", "latex", "--out", tmp_path, "--published", "--which", "context")

    call("tables", *words)

    assert "29.11" in (tmp_path / "context.tex").read_text()
    assert "coverage,ours" in call("tables", "--which", "coverage", "--format", "csv")


def test_several_tables_in_json_or_csv_are_one_document_that_pandas_reads(run_of_two_policies):
    """Would find two documents one after the other, of which a reader takes the first.

    CSV has a line for each of the five columns of a row.
    """
    pandas = pytest.importorskip("pandas")
    words = ("tables", run_of_two_policies, "--by", "difficulty,slots", "--format")

    rows = pandas.read_json(io.StringIO(call(*words, "json")))
    lines = pandas.read_csv(io.StringIO(call(*words, "csv")), na_values="–")

    assert set(rows["table"]) == set(lines["table"]) == {"by_difficulty", "by_slots"}
    assert len(lines) == 5 * len(rows)
    gaps = lines[lines["column"] == "gap"]["word"].dropna().astype(float)
    assert gaps.min() == -100.0


@pytest.mark.parametrize(
    "options",
    [
        ("--format", "csv"),
        ("--by", "difficulty", "--format", "json"),
        ("--which", "facts", "--format", "markdown"),
        ("--which", "failures", "--format", "markdown"),
    ],
)
def test_tables_of_a_packed_run_are_those_of_its_folder(
    run_of_two_policies, pack_of_the_run, options
):
    """But for the path, which the facts have."""
    of_folder = call("tables", *options, run_of_two_policies)
    of_pack = call("tables", *options, pack_of_the_run)

    assert of_pack == of_folder.replace(str(run_of_two_policies), str(pack_of_the_run))


def test_policies_of_a_pack_and_of_a_folder_are_compared_alike(
    run_of_two_policies, pack_of_the_run
):
    """The pack has the folder's records. The listener wins all, the other one nothing in direct."""
    listener_of_pack = call(
        "compare", f"{pack_of_the_run}:listener", f"{run_of_two_policies}:forgetful"
    )
    listener_of_folder = call(
        "compare", f"{run_of_two_policies}:listener", f"{pack_of_the_run}:forgetful"
    )

    assert listener_of_pack == listener_of_folder
    assert "direct: listener (privileged) is better, +100.0 points" in listener_of_pack


def test_figures_of_a_pack_are_drawn_and_their_paths_printed(pack_of_the_run, tmp_path):
    printed = call("figures", pack_of_the_run, "--published", "--which", "gaps", "--out", tmp_path)

    assert [Path(path).name for path in printed.splitlines()][:2] == ["gaps.png", "gaps.svg"]


def test_report_writes_the_page_into_a_run_or_next_to_a_pack(run_of_two_policies, pack_of_the_run):
    """Both pages are equal but for the name of the run."""
    call("report", run_of_two_policies)
    call("report", pack_of_the_run)

    of_folder = (run_of_two_policies / "report.html").read_text("utf-8")
    of_pack = pack_of_the_run.with_name("shipped.html").read_text("utf-8")
    assert of_pack == of_folder.replace("folder-run", "shipped")


def test_report_writes_the_page_of_two_runs_to_out(run_of_two_policies, pack_of_the_run, tmp_path):
    """One is the listener of the packed run, the other the whole folder."""
    out = tmp_path / "page.html"

    call("report", f"{pack_of_the_run}:listener", "--against", run_of_two_policies, "--out", out)

    assert "<title>shipped:listener against folder-run" in out.read_text("utf-8")


def test_run_colon_policy_shows_the_results_of_that_policy_alone(run_of_two_policies):
    """RUN:forgetful gives those lines of the whole run's table that are about *forgetful*."""
    options = ("--which", "main", "--format", "csv")
    head, *rows = call("tables", run_of_two_policies, *options).splitlines()

    forgetful = call("tables", f"{run_of_two_policies}:forgetful", *options)

    assert forgetful.splitlines() == [head, *(row for row in rows if "forgetful" in row)]


def test_two_policies_named_apart_are_shown_as_their_whole_run_is(
    run_of_two_policies, pack_of_the_run
):
    """Both of one run, and one of a folder with one of its pack."""
    options = ("--which", "main", "--format", "csv")
    forgetful = f"{run_of_two_policies}:forgetful"
    whole = call("tables", run_of_two_policies, *options)

    both = call("tables", forgetful, f"{run_of_two_policies}:listener", *options)
    with_pack = call("tables", forgetful, f"{pack_of_the_run}:listener", *options)

    assert both == whole
    assert sorted(with_pack.splitlines()) == sorted(whole.splitlines())


@pytest.mark.parametrize("command", ["tables FIRST SECOND", "compare FIRST SECOND"])
def test_a_command_on_two_runs_warns_if_they_were_rendered_on_different_devices(tmp_path, command):
    """llvmpipe draws on processors; the same scene may look a little different on a GPU."""
    first = write_run(tmp_path / "listener", ("listener",), device="llvmpipe")
    second = write_run(tmp_path / "forgetful", ("forgetful",), device="NVIDIA H100")
    words = command.replace("FIRST", str(first)).replace("SECOND", str(second)).split()

    assert "Mixed render devices: NVIDIA H100, llvmpipe. Their pictures" in call(*words)


def test_merging_runs_and_the_page_of_the_merged_run_warn_of_different_devices(tmp_path):
    """The runs were drawn on a processor (llvmpipe) and on a GPU."""
    first = write_run(tmp_path / "listener", ("listener",), device="llvmpipe")
    second = write_run(tmp_path / "forgetful", ("forgetful",), device="NVIDIA H100")
    warning = "Mixed render devices: NVIDIA H100, llvmpipe. Their pictures"

    assert warning in call("records", "merge", first, second, "--out", tmp_path / "merged")
    assert warning in call("report", tmp_path / "merged")


def test_a_run_whose_device_is_not_known_fits_any_other(run_of_two_policies, tmp_path):
    run = write_run(tmp_path / "listener", ("listener",), device="llvmpipe")

    assert "Mixed" not in call("tables", run, run_of_two_policies)


@pytest.mark.parametrize(
    ("words", "says"),
    [
        ("tables", "Tables need a run"),
        ("tables --which forms", "Tables need a run"),
        ("tables RUN --which planer", "Did you mean 'planner'"),
        ("tables --format pdf", "There is no format 'pdf'"),
        ("tables RUN --which failures --published", "show runs alone"),
        ("tables RUN --which forms", "--forms implicit,resolved"),
        ("tables RUN:listener --which failures", "No episode of the runs failed"),
        ("tables RUN --by pattern,colour", "breakdown 'colour'.*pattern, expression, slots"),
        ("tables RUN:listner", "Did you mean 'listener'"),
        ("tables RUN --which real", "no results for the table 'real'"),
        ("tables EMPTY", "no records in"),
        ("tables FILE", "is not a packed run"),
        ("tables RUN --out FILE", "Cannot write"),
        ("figures --out EMPTY", "Figures need a run"),
        ("figures RUN --out EMPTY --which gap", "Did you mean 'gaps'"),
        ("figures RUN --out FILE --which gaps", "Cannot write "),
        ("figures RUN:listener --out EMPTY --which failures", "nothing to draw for failures"),
        ("figures --published --out EMPTY --which failures", "The paper's tables have nothing to"),
        ("compare RUN nowhere", "There is no run at nowhere;"),
        ("compare RUN RUN:forgetful", "name one as RUN:listener"),
        ("report RUN --serve --out FILE", "--serve shows one run"),
    ],
)
def test_a_command_that_has_nothing_to_show_is_refused_with_the_reason(
    run_of_two_policies, tmp_path, words, says
):
    """RUN is a run of a listener and a forgetful policy, EMPTY a folder, FILE an empty file."""
    (tmp_path / "file").write_text("")
    words = re.sub(r"\bRUN\b", str(run_of_two_policies), words)
    words = re.sub(r"\bEMPTY\b", str(tmp_path), words)
    words = re.sub(r"\bFILE\b", str(tmp_path / "file"), words)

    with pytest.raises(RoboIRGError, match=says):
        call(*words.split())
