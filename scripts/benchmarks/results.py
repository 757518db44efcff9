"""Measured rows: the file docs/bench.json and the table of docs/performance.md."""

from __future__ import annotations

import datetime as dt
import json
import os
import statistics
from collections import defaultdict
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

from written_parts import table

from benchmarks.measures import Measure
from roboirg.core.errors import InvalidValueError
from roboirg.core.version import __version__
from roboirg.util.processor import processor_features

Row = dict[str, Any]

HEADS = ("measure", "ours", "baseline", "ratio", "goal", "date", "load")
NUMBERS = ("ours", "baseline", "ratio", "goal", "load")
_WHOLE = 1000
"""From here on values are shown as whole numbers."""


def run_measures(
    measures: Sequence[Measure], rounds: int, report: Callable[[str], None]
) -> list[Row]:
    """Run every measure in every round, after its baseline, which is timed once per round.

    Returns:
        The row of each: all rounds, the median of ours, the ratio of the medians (greater is
        better), the goal, the machine, the date, and the load of the five minutes before, which is
        that of others.
    """
    load = os.getloadavg()[1]
    ours: dict[Measure, list[float]] = defaultdict(list)
    baselines: dict[object, list[float]] = defaultdict(list)
    for number in range(1, rounds + 1):
        for measure in measures:
            report(f"round {number} of {rounds}: {measure.name}")
            baseline = measure.baseline
            if baseline is not None and len(baselines[baseline]) < number:
                baselines[baseline].append(baseline())
            ours[measure].append(measure.ours())
    where = {
        "date": dt.datetime.now(dt.UTC).date().isoformat(),
        "machine": f"{os.cpu_count()} cores, {processor_features().splitlines()[0]}",
        "load": round(load, 1),
        "roboirg": __version__,
    }
    rows = []
    for measure in measures:
        rows.append(_figures(measure, ours[measure], baselines[measure.baseline]) | where)
    return rows


def _figures(measure: Measure, ours: list[float], baseline: list[float]) -> Row:
    value = statistics.median(ours)
    ratio = None
    if baseline:
        ratio = statistics.median(baseline) / value
        if measure.unit.startswith("1/"):
            ratio = value / statistics.median(baseline)
    return {
        "name": measure.name, "unit": measure.unit, "ours": ours, "baseline": baseline,
        "against": measure.against, "value": value, "ratio": ratio, "goal": measure.goal,
    }  # fmt: skip


def reaches(row: Row) -> bool:
    """Return whether a row reaches its goal."""
    if row["ratio"] is None:
        return bool(row["value"] <= row["goal"])
    return bool(row["ratio"] >= row["goal"])


def update_figures(path: Path, measured: Sequence[Row]) -> None:
    """Write rows to a file as JSON.

    A file of earlier results is kept up to date: what was measured now takes the place of the row
    of the same name, other rows stay.
    """
    rows = {}
    if path.exists():
        rows = {_key(row): row for row in read_figures(path)}
    for row in measured:
        rows[_key(row)] = row
    path.write_text(json.dumps({"figures": list(rows.values())}, indent=1) + "\n", "utf-8")


def read_figures(path: Path) -> list[Row]:
    """Return the rows of a file that `update_figures` wrote."""
    try:
        figures = json.loads(path.read_text(encoding="utf-8"))["figures"]
        return [dict(row) for row in figures if _key(row)]
    except (OSError, ValueError, KeyError, TypeError) as error:
        raise InvalidValueError(f"{str(path)!r} holds no results of bench: {error}") from error


def markdown_table(figures: Sequence[Mapping[str, Any]]) -> str:
    """Return rows as a table for the documents."""
    rows = []
    for row in figures:
        goal = f"at most {row['goal']:g} {row['unit']}"
        base = ""
        ratio = ""
        if row["ratio"] is not None:
            median = statistics.median(row["baseline"])
            base = f"{_format_value(median, row['unit'])} ({row['against']})"
            ratio = f"{row['ratio']:.3g} ×"
            goal = f"{row['goal']:g} ×"
        ours = _format_value(row["value"], row["unit"])
        rows.append((row["name"], ours, base, ratio, goal, row["date"], row["load"]))
    return table(HEADS, rows, NUMBERS) + "\n"


def _format_value(value: float, unit: str) -> str:
    if unit == "ms":
        value *= 1e3  # times are in seconds
    if value >= _WHOLE:
        return f"{value:,.0f} {unit}"
    return f"{value:.3g} {unit}"


def _key(row: Mapping[str, Any]) -> tuple[str, str]:
    return (row["name"], row["against"])
