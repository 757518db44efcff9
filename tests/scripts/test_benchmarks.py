"""Our benchmarks: goals, the file of figures, and the page made from it."""

import re
import runpy
import subprocess
from pathlib import Path
from typing import get_args

import pytest
from benchmarks import large_run_costs
from benchmarks.measures import Measure, all_measures
from benchmarks.process_costs import probe
from benchmarks.results import (
    reaches,
    read_figures,
    run_measures,
    update_figures,
)
from typer.testing import CliRunner

from roboirg.core.errors import InvalidValueError
from roboirg.main import app

ROOT = Path(__file__).parents[2]


def test_baselines_are_timed_once_a_round():
    """Two rows that share a baseline, and three rounds."""
    timed = []

    def base():
        timed.append("base")
        return 4.0

    def pace():
        timed.append("pace")
        return 8.0

    rows = (Measure(1.9, "pace", pace, base, "one"), Measure(1.9, "again", pace, base, "one"))
    run_measures(rows, 3, lambda _text: None)

    assert timed == ["base", "pace", "pace"] * 3


def test_a_row_has_the_median_of_all_rounds():
    """The paces of three rounds are 8, 2 and 9, so 8 is the median; the baseline is always 4, so
    the ratio is 2."""
    paces = iter([8.0, 2.0, 9.0])
    row = Measure(1.9, "pace", lambda: next(paces), lambda: 4.0, "one", "1/h")

    (found,) = run_measures((row,), 3, lambda _text: None)

    assert (found["value"], found["ratio"]) == (8.0, 2.0)


@pytest.mark.parametrize(
    ("goal", "value", "base", "unit", "reached"),
    [
        (1.9, 8.0, 4.0, "1/h", True),
        (2.1, 8.0, 4.0, "1/h", False),
        (0.6, 8.0, 4.0, "s", False),
        (0.3, 0.25, None, "GiB", True),
        (0.2, 0.25, None, "GiB", False),
    ],
)
def test_greater_ratios_to_a_baseline_are_better_and_smaller_amounts_are(
    goal, value, base, unit, reached
):
    """A pace is divided by its baseline, and of times the baseline by the time."""
    baseline = None if base is None else lambda: base
    measure = Measure(goal, "it", lambda: value, baseline, "one", unit)

    (row,) = run_measures((measure,), 1, lambda _text: None)

    assert reaches(row) == reached


def write_figures(path, **values):
    """Measure these values, and note them in a file of figures."""
    measures = [Measure(0.5, name, lambda value=value: value) for name, value in values.items()]
    update_figures(path, run_measures(measures, 1, lambda _text: None))


def test_figures_that_are_measured_anew_replace_those_in_the_file(tmp_path):
    """A file has the first and the second figure; then the second and a third one are measured. The
    first one stays, and each is noted with date, machine and load."""
    path = tmp_path / "bench.json"
    write_figures(path, first=1234.0, second=2.0)

    write_figures(path, second=3.0, third=4.0)

    figures = read_figures(path)
    assert [(figure["name"], figure["value"]) for figure in figures] == [
        ("first", 1234.0), ("second", 3.0), ("third", 4.0),
    ]  # fmt: skip
    assert all(figure["date"] and figure["machine"] and figure["load"] >= 0 for figure in figures)


def test_a_file_that_holds_no_figures_is_refused(tmp_path):
    path = tmp_path / "bench.json"
    path.write_text("[]")

    with pytest.raises(InvalidValueError, match="holds no results of bench"):
        write_figures(path, first=1.0)


def test_the_costs_of_a_command_are_its_processor_time():
    assert probe("command", "--version")["cpu_s"] > 0


def test_the_costs_of_a_command_that_fails_are_no_result(tmp_path):
    with pytest.raises(subprocess.CalledProcessError):
        probe("command", "tables", str(tmp_path / "missing"))


@pytest.mark.parametrize("command", get_args(large_run_costs.Command))
def test_a_command_whose_costs_are_measured_exists(command):
    assert CliRunner().invoke(app, [*command.split(), "--help"]).exit_code == 0


@pytest.mark.sim
def test_the_file_has_the_rows_that_are_measured_with_their_goals():
    figures = read_figures(ROOT / "docs" / "bench.json")
    measured = [(measure.name, measure.unit, measure.goal) for measure in all_measures()]
    assert sorted(measured) == sorted(
        (figure["name"], figure["unit"], figure["goal"]) for figure in figures
    )


def test_the_performance_page_shows_the_file_of_figures():
    script = runpy.run_path(str(ROOT / "scripts" / "write_bench_table.py"))
    assert script["PAGE"].read_text() == script["page_text"]()


def test_no_other_page_has_figures_of_its_own():
    """Figures of speed are written as "… steps a second behind", "… in process" or "… 1/s"."""
    for page in ROOT.glob("docs/*.md"):
        if page.name != "performance.md":
            figures = re.findall(
                r"\d steps a second (?:behind|in process)|\d 1/s", page.read_text()
            )
            assert figures == [], page.name
