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
    markdown_table,
    reaches,
    read_figures,
    run_measures,
    update_figures,
)
from typer.testing import CliRunner

from roboirg.core.errors import InvalidValueError
from roboirg.main import app

ROOT = Path(__file__).parents[2]


def test_baselines_are_timed_once_a_round_and_rows_have_the_median_of_all_rounds():
    """Greater ratios are better."""
    asked = []
    paces = iter([8.0, 2.0, 9.0])

    def rate(name, value):
        asked.append(name)
        return value

    def base():
        return rate("base", 4.0)

    rows = (
        Measure(1.9, "pace", lambda: rate("pace", next(paces)), base, "one", "1/h"),
        Measure(0.6, "time", lambda: rate("time", 8.0), base, "one"),
        Measure(0.3, "memory", lambda: rate("memory", 0.25), unit="GiB"),
    )

    found = run_measures(rows, 3, lambda _text: None)

    assert asked == ["base", "pace", "time", "memory"] * 3
    assert [(row["value"], row["ratio"]) for row in found] == [(8.0, 2.0), (8.0, 0.5), (0.25, None)]
    assert [reaches(row) for row in found] == [True, False, True]
    assert [reaches({**row, "goal": 0.2}) for row in found] == [True, True, False]


def test_a_file_of_figures_is_kept_up_to_date(tmp_path):
    path = tmp_path / "bench.json"

    def measured(**values):
        measures = [Measure(0.5, name, lambda value=value: value) for name, value in values.items()]
        update_figures(path, run_measures(measures, 1, lambda _text: None))

    measured(first=1234.0, second=2.0)
    measured(second=3.0, third=4.0)
    figures = read_figures(path)

    assert [(figure["name"], figure["value"]) for figure in figures] == [
        ("first", 1234.0), ("second", 3.0), ("third", 4.0),
    ]  # fmt: skip
    assert all(figure["date"] and figure["machine"] and figure["load"] >= 0 for figure in figures)
    assert "| first | 1,234 s |  |  | at most 0.5 s |" in markdown_table(figures)

    path.write_text("[]")
    with pytest.raises(InvalidValueError, match="holds no results of bench"):
        measured(first=1.0)


def test_the_costs_of_a_command_that_fails_are_no_result(tmp_path):
    assert probe("command", "--version")["cpu_s"] > 0
    with pytest.raises(subprocess.CalledProcessError):
        probe("command", "tables", str(tmp_path / "missing"))
    for command in get_args(large_run_costs.Command):
        assert CliRunner().invoke(app, [*command.split(), "--help"]).exit_code == 0


@pytest.mark.sim
def test_the_file_has_the_rows_that_are_measured_with_their_goals():
    figures = read_figures(ROOT / "docs" / "bench.json")
    measured = [(measure.name, measure.unit, measure.goal) for measure in all_measures()]
    assert sorted(measured) == sorted(
        (figure["name"], figure["unit"], figure["goal"]) for figure in figures
    )


def test_the_performance_page_shows_the_file_and_no_page_has_figures_of_its_own():
    script = runpy.run_path(str(ROOT / "scripts" / "write_bench_table.py"))
    assert script["PAGE"].read_text() == script["page_text"]()
    for page in ROOT.glob("docs/*.md"):
        if page.name != "performance.md":
            assert not re.search(r"\d steps a second (behind|in process)|\d 1/s", page.read_text())
