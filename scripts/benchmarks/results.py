"""Results against goals: the file docs/bench.json and the table of docs/performance.md."""

from __future__ import annotations

import json
import statistics
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from benchmarks.goals import Goal
from roboirg.apps.bench.bench_runner import MeasureResult, circumstances, format_value, write_json
from roboirg.core.errors import InvalidValueError

Row = dict[str, Any]


def reaches(result: MeasureResult, goal: float) -> bool:
    return result.value <= goal if result.ratio is None else result.ratio >= goal


def update_figures(
    path: Path, goals: Sequence[Goal], results: Sequence[MeasureResult], load: float
) -> None:
    """Write all rounds of all results as JSON, each with its goal, machine, date and load.

    A file of earlier results is kept up to date: what was measured now takes the place of the row
    of the same name, other rows stay.

    Args:
        path: the file.
        goals: what was measured.
        results: that of each goal.
        load: load average of the five minutes before, which is the load of others.
    """
    rows = {_key(row): row for row in read_figures(path)} if path.exists() else {}
    for goal, result in zip(goals, results, strict=True):
        row = {**result.as_json(), "goal": goal.least, **circumstances(load)}
        rows[_key(row)] = row
    write_json(list(rows.values()), path)


def read_figures(path: Path) -> list[Row]:
    """Return the rows of a file that `update_figures` wrote."""
    try:
        figures = json.loads(path.read_text(encoding="utf-8"))["figures"]
        return [dict(row) for row in figures if _key(row)]
    except (OSError, ValueError, KeyError, TypeError) as error:
        raise InvalidValueError(f"{str(path)!r} holds no results of bench: {error}") from error


def markdown_table(figures: Sequence[Mapping[str, Any]]) -> str:
    """Return the rows of a file of results as a table for the documents."""
    lines = ["| measure | ours | baseline | ratio | goal | date | load |",
             "| --- | ---: | ---: | ---: | ---: | --- | ---: |"]  # fmt: skip
    for row in figures:
        base, ratio, goal = "", "", f"at most {row['goal']:g} {row['unit']}"
        if row["ratio"] is not None:
            median = statistics.median(row["baseline"])
            base = f"{format_value(median, row['unit'])} ({row['against']})"
            ratio, goal = f"{row['ratio']:.3g} ×", f"{row['goal']:g} ×"
        ours = format_value(row["value"], row["unit"])
        cells = (row["name"], ours, base, ratio, goal, row["date"], row["load"])
        lines.append(f"| {' | '.join(map(str, cells))} |")
    return "\n".join(lines) + "\n"


def _key(row: Mapping[str, Any]) -> tuple[str, str]:
    return (row["name"], row["against"])
