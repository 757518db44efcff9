"""The bench: medians against goals, and rows that need a package that is not there."""

from __future__ import annotations

import io
import json
from pathlib import Path

from rich.console import Console

from roboirg.perf.bench_runner import results_table, run_measures, write_results
from roboirg.perf.measures import Measure


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
    write_results([pace, memory, model], tmp_path / "rounds.json")
    figures = json.loads((tmp_path / "rounds.json").read_text())["figures"]
    assert [one["missing"] for one in figures] == ["", "", "no_such"]
