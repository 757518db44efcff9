"""The bench: rounds, medians, ratios, and the file of the command."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from typer.testing import CliRunner

from roboirg.apps.bench import measures
from roboirg.apps.bench.bench_runner import Measure, run_measures
from roboirg.core.errors import InvalidValueError
from roboirg.main import app


def test_baselines_are_timed_once_a_round_and_greater_ratios_are_better() -> None:
    asked: list[str] = []

    def rate(name: str, value: float) -> float:
        asked.append(name)
        return value

    def base() -> float:
        return rate("base", 4.0)

    rows = (
        Measure("pace", lambda: rate("pace", 8.0), base, "one", "1/h"),
        Measure("time", lambda: rate("time", 8.0), base, "one", "s"),
        Measure("memory", lambda: rate("memory", 0.25), None, "", "GiB"),
    )
    pace, seconds, memory = run_measures(rows, 2, lambda _text: None)
    assert asked == ["base", "pace", "time", "memory"] * 2
    assert (pace.value, pace.ratio) == (8.0, 2.0)
    assert (seconds.value, seconds.ratio) == (8.0, 0.5)
    assert (memory.value, memory.ratio) == (0.25, None)
    with pytest.raises(InvalidValueError, match="rounds is 0"):
        run_measures(rows, 0, lambda _text: None)


def test_the_command_writes_every_round_to_a_new_file(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    values = iter([1.0, 3.0, 2.0])
    row = Measure("a step", lambda: next(values), lambda: 4.0, "stock", "s")
    monkeypatch.setattr(measures, "measures", lambda: (row,))
    path = tmp_path / "rounds.json"
    words = ["bench", "--rounds", "3", "--out", str(path)]
    done = CliRunner().invoke(app, words)
    assert done.exit_code == 0, done.output
    assert "2.00 x" in done.output
    (figure,) = json.loads(path.read_text())["figures"]
    assert (figure["ours"], figure["value"], figure["ratio"]) == ([1.0, 3.0, 2.0], 2.0, 2.0)
    assert figure["machine"]
    assert figure["date"]
    before = path.read_bytes()
    again = CliRunner().invoke(app, words)
    assert isinstance(again.exception, InvalidValueError)
    assert "must name a new file" in str(again.exception)
    assert path.read_bytes() == before
    lost = CliRunner().invoke(app, [*words[:-1], str(tmp_path / "missing" / "rounds.json")])
    assert "is not in an existing folder" in str(lost.exception)
