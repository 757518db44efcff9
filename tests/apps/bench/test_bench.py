"""The bench: medians against goals, and rows that need a package that is not there."""

from __future__ import annotations

import io
import json
import re
import runpy
from pathlib import Path

import pytest
from rich.console import Console

from roboirg.apps.bench.bench_runner import (
    markdown_table,
    read_figures,
    results_table,
    run_measures,
    write_results,
)
from roboirg.apps.bench.measures import Measure
from roboirg.core.errors import InvalidValueError

ROOT = Path(__file__).parents[3]


def test_a_row_whose_package_is_not_installed_says_so(tmp_path: Path) -> None:
    asked: list[str] = []

    def rate(name: str, value: float) -> float:
        asked.append(name)
        return value

    rows = (
        Measure("pace", lambda: rate("ours", 8.0), lambda: rate("base", 4.0), "one", 1.5, "1/h",
                inverse=True),
        Measure("memory", lambda: rate("memory", 0.25), None, "", 0.5, "GiB"),
        Measure("model", lambda: rate("model", 1.0), lambda: 1.0, "one", 1.5, package="no_such"),
    )  # fmt: skip
    pace, memory, model = run_measures(rows, 2, lambda _text: None)
    assert asked == ["base", "ours", "memory"] * 2
    assert (pace.value, pace.ratio, pace.reached) == (8.0, 2.0, True)
    assert (memory.value, memory.ratio, memory.reached) == (0.25, None, True)
    assert (model.value, model.ratio, model.reached) == (None, None, False)
    console = Console(file=io.StringIO(), width=150)
    console.print(results_table([pace, memory, model]))
    text = console.file.getvalue()  # type: ignore[attr-defined]
    assert "no_such is not installed" in text
    assert "2.00 x" in text
    write_results([pace, memory, model], tmp_path / "rounds.json", load=0.5)
    figures = json.loads((tmp_path / "rounds.json").read_text())["figures"]
    assert [one["missing"] for one in figures] == ["", "", "no_such"]


def test_a_file_of_results_is_kept_up_to_date(tmp_path: Path) -> None:
    path = tmp_path / "bench.json"

    def measured(**values: float) -> None:
        rows = [
            Measure(name, lambda value=value: value, None, "", 0.5, "s")
            for name, value in values.items()
        ]
        write_results(run_measures(rows, 1, lambda _text: None), path, load=0.5)

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


def test_the_performance_page_shows_the_file_and_no_page_has_figures_of_its_own() -> None:
    script = runpy.run_path(str(ROOT / "scripts" / "write_bench_table.py"))
    assert script["PAGE"].read_text() == script["page_text"]()
    for page in ROOT.glob("docs/*.md"):
        if page.name != "performance.md":
            assert not re.search(r"\d steps a second (behind|in process)|\d 1/s", page.read_text())
