"""Our benchmarks: goals, the file of figures, and the page made from it."""

from __future__ import annotations

import re
import runpy
import subprocess
from pathlib import Path
from typing import get_args

import pytest
from benchmarks import large_run_costs
from benchmarks.goals import Goal, all_goals
from benchmarks.process_costs import probe
from benchmarks.results import markdown_table, reaches, read_figures, update_figures

from roboirg.apps.bench.bench_runner import Measure, run_measures
from roboirg.core.errors import InvalidValueError

ROOT = Path(__file__).parents[2]


def test_a_goal_is_a_least_ratio_or_a_largest_value() -> None:
    rows = (
        Measure("pace", lambda: 8.0, lambda: 4.0, "one", "1/h"),
        Measure("memory", lambda: 0.25, None, "", "GiB"),
    )
    pace, memory = run_measures(rows, 1, lambda _text: None)
    assert [reaches(pace, goal) for goal in (1.9, 2.1)] == [True, False]
    assert [reaches(memory, goal) for goal in (0.3, 0.2)] == [True, False]


def test_a_file_of_figures_is_kept_up_to_date(tmp_path: Path) -> None:
    path = tmp_path / "bench.json"

    def measured(**values: float) -> None:
        goals = [
            Goal(0.5, Measure(name, lambda value=value: value, None, "", "s"))
            for name, value in values.items()
        ]
        results = run_measures([one.measure for one in goals], 1, lambda _text: None)
        update_figures(path, goals, results, load=0.5)

    measured(first=1234.0, second=2.0)
    measured(second=3.0, third=4.0)
    figures = read_figures(path)
    assert [(one["name"], one["value"]) for one in figures] == [
        ("first", 1234.0), ("second", 3.0), ("third", 4.0),
    ]  # fmt: skip
    assert all(one["date"] and one["machine"] and one["load"] == 0.5 for one in figures)
    assert "| first | 1,234 s |  |  | at most 0.5 s |" in markdown_table(figures)
    path.write_text("[]")
    with pytest.raises(InvalidValueError, match="holds no results of bench"):
        measured(first=1.0)


def test_the_costs_of_a_command_that_fails_are_no_result(tmp_path: Path) -> None:
    assert probe("command", "--version")["cpu_s"] > 0
    with pytest.raises(subprocess.CalledProcessError):
        probe("command", "tables", str(tmp_path / "missing"))
    for command in get_args(large_run_costs.Command):
        assert probe("command", *command.split(), "--help")["memory_gib"] > 0


@pytest.mark.sim
def test_the_file_has_the_rows_that_are_measured_with_their_goals() -> None:
    figures = read_figures(ROOT / "docs" / "bench.json")
    measured = [(one.measure.name, one.measure.unit, one.least) for one in all_goals()]
    assert sorted(measured) == sorted((one["name"], one["unit"], one["goal"]) for one in figures)


def test_the_performance_page_shows_the_file_and_no_page_has_figures_of_its_own() -> None:
    script = runpy.run_path(str(ROOT / "scripts" / "write_bench_table.py"))
    assert script["PAGE"].read_text() == script["page_text"]()
    for page in ROOT.glob("docs/*.md"):
        if page.name != "performance.md":
            assert not re.search(r"\d steps a second (behind|in process)|\d 1/s", page.read_text())
