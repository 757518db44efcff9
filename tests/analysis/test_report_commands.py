"""The commands `tables`, `compare`, `figures` and `report` on real folders and packs."""

from __future__ import annotations

import io
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
    """With the published results, a run has five tables. The folder does not exist before; the
    command prints the path of each file.
    """
    out = tmp_path / "new" / "tables"

    printed = call(
        "tables", run_of_two_policies, "--format", "latex", "--out", out, "--published"
    ).split()

    names = {path.name for path in out.iterdir()}
    assert names == {"coverage.tex", "main.tex", "planner.tex", "context.tex", "real.tex"}
    assert sorted(printed) == sorted(map(str, out.iterdir()))


def test_published_tables_need_no_run(tmp_path):
    """29.11 is a rate that RoboMME's paper publishes in its table of contexts; which settings a
    task has is our own table, `coverage`.
    """
    words = ("--format", "latex", "--out", tmp_path, "--published", "--which", "context")

    call("tables", *words)

    assert "29.11" in (tmp_path / "context.tex").read_text()
    assert "coverage,ours" in call("tables", "--which", "coverage", "--format", "csv")


def test_several_tables_in_json_or_csv_are_one_document_that_pandas_reads(run_of_two_policies):
    """Would find two documents one after the other, of which a reader takes the first.

    JSON has a row for each line of a table, CSV one for each of the five columns of numbers in such
    a line. The run's forgetful policy wins all in *explicit* and nothing in *direct*, so its gap is
    -100 points.
    """
    pandas = pytest.importorskip("pandas")
    words = ("tables", run_of_two_policies, "--by", "difficulty,slots", "--format")

    lines = pandas.read_json(io.StringIO(call(*words, "json")))
    cells = pandas.read_csv(io.StringIO(call(*words, "csv")), na_values="–")

    gaps = cells[cells["column"] == "gap"]["word"].dropna().astype(float)
    assert set(lines["table"]) == set(cells["table"]) == {"by_difficulty", "by_slots"}
    assert len(cells) == 5 * len(lines)
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
    """A pack is a zip file of the run. The tables of facts name the path of the run or of its pack,
    which is the only difference.
    """
    of_folder = call("tables", *options, run_of_two_policies)
    of_pack = call("tables", *options, pack_of_the_run)

    assert of_pack == of_folder.replace(str(run_of_two_policies), str(pack_of_the_run))


def test_policies_of_a_pack_and_of_a_folder_are_compared_alike(
    run_of_two_policies, pack_of_the_run
):
    """The pack holds the run of the folder, so it makes no difference which of two policies comes
    from where. The listener wins all episodes, the forgetful policy none in *direct*: +100 points.
    *Privileged* are policies that read the simulator's state.
    """
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
    """The page of the folder is report.html in it; that of shipped.roboirg.zip is shipped.html next
    to it. Both are equal but for the name of the run, which is that of the folder or of the pack.
    """
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


def test_a_policy_of_a_folder_and_one_of_its_pack_are_shown_as_the_whole_run_is(
    run_of_two_policies, pack_of_the_run
):
    """The pack holds the same run as the folder; the order of the lines is that of the options."""
    options = ("--which", "main", "--format", "csv")
    policies = (f"{run_of_two_policies}:forgetful", f"{pack_of_the_run}:listener")

    lines = call("tables", *policies, *options).splitlines()

    whole = call("tables", run_of_two_policies, *options).splitlines()
    assert sorted(lines) == sorted(whole)


def test_commands_on_two_runs_warn_if_these_were_rendered_on_different_devices(tmp_path):
    """A software renderer (llvmpipe) and a graphics card draw slightly different pictures, so that
    results of the two may differ for this reason alone.
    """
    first = write_run(tmp_path / "listener", ("listener",), device="llvmpipe")
    second = write_run(tmp_path / "forgetful", ("forgetful",), device="NVIDIA H100")
    merged = tmp_path / "merged"
    warning = "Mixed render devices: NVIDIA H100, llvmpipe. Their pictures"

    assert warning in call("tables", first, second)
    assert warning in call("compare", first, second)
    assert warning in call("records", "merge", first, second, "--out", merged)
    assert warning in call("report", merged)


@pytest.mark.parametrize(
    ("command", "message"),
    [
        # what it needs is not there
        ("tables", "Tables need a run"),
        ("tables --which forms", "Tables need a run"),
        ("figures --out {empty}", "Figures need a run"),
        ("tables {empty}", "no records in"),
        ("tables {file}", "is not a packed run"),
        ("compare {run} nowhere", "There is no run at nowhere;"),
        ("compare {run} {run}:forgetful", "name one as RUN:listener"),
        # a name is unknown
        ("tables {run} --which planer", "Did you mean 'planner'"),
        ("tables --format pdf", "There is no format 'pdf'"),
        ("tables {run} --by pattern,colour", "breakdown 'colour'.*pattern, expression, slots"),
        ("tables {run}:listner", "Did you mean 'listener'"),
        ("figures {run} --out {empty} --which gap", "Did you mean 'gaps'"),
        # the run has no results of this kind: the listener never fails, no form was spelled out
        ("tables {run} --which failures --published", "show runs alone"),
        ("tables {run} --which forms", "--forms implicit,resolved"),
        ("tables {run}:listener --which failures", "No episode of the runs failed"),
        ("tables {run} --which real", "no results for the table 'real'"),
        ("figures {run}:listener --out {empty} --which failures", "nothing to draw for failures"),
        ("figures --published --out {empty} --which failures", "The paper's tables have nothing"),
        # it cannot be written there
        ("tables {run} --out {file}", "Cannot write"),
        ("figures {run} --out {file} --which gaps", "Cannot write "),
        ("report {run} --serve --out {file}", "--serve shows one run"),
    ],
)
def test_a_command_that_has_nothing_to_show_is_refused_with_the_reason(
    run_of_two_policies, tmp_path, command, message
):
    """{run} stands for a run of a listener, which wins all, and of a forgetful policy, {empty} for
    a folder without a run, and {file} for an empty file. Messages are patterns."""
    file = tmp_path / "file"
    file.touch()
    command = command.format(run=run_of_two_policies, empty=tmp_path, file=file)

    with pytest.raises(RoboIRGError, match=message):
        call(*command.split())
