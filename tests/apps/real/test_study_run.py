"""A study from its plan to its table: played on the twin, killed, resumed, scored, told."""

import re
import signal
import subprocess
import sys
import time

import pytest
from real_start import start
from selection import slow_but

from roboirg.apps.real.control.control_loop import Interruption
from roboirg.apps.real.study.failure_choices import failure_choices
from roboirg.apps.real.study.study_plan import read_study
from roboirg.apps.real.study.trial_log import TrialLog, trial_metadata
from roboirg.evaluation.analysis.figures import write_figures
from roboirg.evaluation.analysis.figures.real_robot import bar_series
from roboirg.evaluation.analysis.stats.cells import gather
from roboirg.evaluation.analysis.stats.run_data import RunData
from roboirg.evaluation.analysis.tables.paper_tables import make_table
from roboirg.evaluation.records.store import read_records, read_results

pytestmark = pytest.mark.sim

SETTINGS = ("explicit", "reasoning", "contextual")
OPTIONS = ("--policy", "listener", "--policy", "forgetful", "--settings", ",".join(SETTINGS))


def finished(*words):
    process = start(*words)
    text, _ = process.communicate(timeout=600)
    assert process.returncode == 0, text
    return text


@pytest.fixture(scope="module")
def study(tmp_path_factory):
    """Twelve trials, played; killed after some and resumed."""
    folder = tmp_path_factory.mktemp("study") / "run"
    finished("plan", *OPTIONS, "--trials", 1, "--demonstrations", 2, "--out", folder)
    assert {path.name for path in folder.iterdir()} == {
        "plan.json", "trials.csv", "demonstrations.csv", "sheet.pdf",
    }  # fmt: skip
    # A busy machine must not make a policy late.
    limits = folder.parent / "limits.json"
    limits.write_text('{"policy_timeout_s": 60}')
    play = ("run", folder, "--score", "operator", "--limits", limits)
    process = start(*play)
    records = folder / "records.jsonl"
    deadline = time.monotonic() + 600
    while not (records.exists() and records.read_text().count("\n") >= 4):
        assert time.monotonic() < deadline
        time.sleep(0.05)
    process.send_signal(signal.SIGKILL)
    process.wait(timeout=600)
    killed = records.read_bytes()
    assert killed.count(b"\n") < 12
    text = finished(*play)
    assert records.read_bytes().startswith(killed[: killed.rindex(b"\n")])
    played = 12 - killed.count(b"\n")
    assert f"Played {played} trials; 0 ended in an error." in text
    return folder


@pytest.mark.slow
def test_every_trial_was_played_once_and_waits(study):
    plan = read_study(study)
    trial_log = TrialLog.read(plan, study)
    assert len(read_records(study)) == len(plan.trials) == 12
    assert len((study / "records.jsonl").read_text().splitlines()) == 12
    assert {trial_log.state(trial.name) for trial in plan.trials} == {"waiting"}
    # What the judge saw is not where the operator sees it.
    assert not any(record.events or record.attribution for record in read_records(study))
    table = make_table("real", gather([("run", read_results(study))]))
    assert all(entry.percent is None for row in table.rows for entry in row.entries)


@pytest.mark.slow
@pytest.mark.browser
def test_scored_in_a_browser_it_is_the_table_that_the_judge_would_have_given(
    browser, study, wait_s
):
    plan = read_study(study)
    before = TrialLog.read(plan, study)
    judged = {t.name: trial_metadata(before.newest(t.name))["judge"] for t in plan.trials}
    process = start("score", study, "--operator", "ann")
    page = browser.new_page()
    page.set_default_timeout(1000 * wait_s)
    page.goto(re.search(r"http\S+", process.stdout.readline())[0])
    for number, trial in enumerate(plan.trials):
        verdict = judged[trial.name]
        choices = [one.failure for one in failure_choices(trial.episode)]
        key = "s" if verdict["outcome"] == "success" else str(
            choices.index(verdict["failure"]) + 1
        )  # fmt: skip
        with page.expect_navigation():
            page.keyboard.press(key)
        if number == 5:  # killed in the middle, and gone on
            process.send_signal(signal.SIGKILL)
            process.wait(timeout=600)
            process = start("score", study, "--operator", "bob")
            page.goto(re.search(r"http\S+", process.stdout.readline())[0])
    page.close()
    process.kill()
    process.wait(timeout=600)
    records = {record.identity: record for record in read_records(study)}
    for number, trial in enumerate(plan.trials):
        record = records[trial.job]
        assert record.outcome == judged[trial.name]["outcome"]
        found = record.attribution.failure if record.attribution else None
        assert found == judged[trial.name]["failure"]
        assert trial_metadata(record)["operator"] == ("ann" if number <= 5 else "bob")
        assert record.steps > 50
    samples = gather([("run", read_results(study))])
    table = make_table("real", samples, published=True)
    marked = [row for row in table.rows if row.source == "ours"]
    marks = " (privileged) (twin)"
    assert all(row.name.endswith(marks) for row in marked)
    ours = {(row.group, row.name.removesuffix(marks)): row for row in marked}
    assert set(ours) == {(one, who) for one in SETTINGS for who in ("listener", "forgetful")}
    for setting in SETTINGS:
        assert [float(entry.percent) for entry in ours[setting, "listener"].entries] == [100.0] * 3
    assert sum(row.source == "published" for row in table.rows) == 10
    # And the figure has the same numbers.
    bars = {one.name: one.bars for one in bar_series(table)}
    assert bars["listener" + marks]["PutInBox", "reasoning"].percent == 100.0
    assert bars["pi0.5"]["PickByCount", "explicit"].percent == 50.0
    low, high = bars["pi0.5"]["PickByCount", "explicit"][1:]
    assert (low, high) == pytest.approx((23.7, 76.3), abs=0.1)
    content = RunData.of([("run", read_results(study))])
    for path in write_figures(content, study / "figure", ["real"], published=True):
        assert path.stat().st_size > 10_000


@pytest.mark.slow
def test_two_loops_do_not_share_a_robot(study):
    from roboirg.apps.real.study.study_run import lock_robot

    with lock_robot(study):
        process = start("run", study)
        text, _ = process.communicate(timeout=600)
    assert process.returncode != 0
    assert "Another process plays the study" in text


@pytest.mark.slow
def test_a_policy_outside_the_plan_is_refused(study):
    process = start("run", study, "--policy", "oracle")
    text, _ = process.communicate(timeout=600)
    assert "There is no policy in the plan 'oracle'" in text


@pytest.mark.parametrize("sign", [signal.SIGINT, signal.SIGTERM])
def test_a_signal_ends_the_run_also_where_python_drops_the_exception(sign, monkeypatch):
    class Finalized:
        def __del__(self):
            signal.raise_signal(sign)

    before = {one: signal.getsignal(one) for one in (signal.SIGINT, signal.SIGTERM)}
    interruption = Interruption()
    interruption.watch()
    ask = interruption.before(lambda: True)
    dropped = []
    monkeypatch.setattr(sys, "unraisablehook", lambda lost: dropped.append(lost.exc_type))
    try:
        assert ask()
        Finalized()
        assert dropped == [KeyboardInterrupt]
        with pytest.raises(KeyboardInterrupt):
            ask()
    finally:
        for one, handler in before.items():
            signal.signal(one, handler)


@pytest.mark.parametrize("sign", slow_but([signal.SIGTERM], [signal.SIGINT, signal.SIGTERM]))
def test_a_run_that_is_told_to_end_keeps_what_was_played(sign, tmp_path):
    finished("plan", *OPTIONS, "--trials", 8, "--demonstrations", 0, "--out", tmp_path)
    process = start("run", tmp_path)
    assert process.stdout.readline().startswith("1. ")
    process.send_signal(sign)
    try:
        text, _ = process.communicate(timeout=600)
    except subprocess.TimeoutExpired:
        process.kill()
        raise
    assert process.returncode == 130, text
    assert read_records(tmp_path)
