"""Runs measures in alternating rounds; reports medians as a table and JSON."""

from __future__ import annotations

import datetime as dt
import importlib.util
import json
import os
import statistics
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from rich.table import Table

from roboirg.apps.bench.measures import Measure
from roboirg.core.errors import InvalidValueError
from roboirg.core.version import __version__
from roboirg.util.processor import processor_model

_WHOLE = 1000
"""From here on values are shown as whole numbers."""
_SCALES = {"ms": 1e3}
"""Factors from stored to displayed units; other units have factor 1."""


@dataclass(frozen=True)
class MeasureResult:
    """The result of a measure.

    Attributes:
        name: name of the measure.
        unit: unit in tables; stored times are in seconds.
        ours: result of each round.
        baseline: baseline of each round; empty for measures without one.
        against: name of the baseline.
        value: median of `ours`; None if it could not be measured.
        ratio: ratio of the medians, greater is better; None without a baseline.
        goal: smallest ratio; without a baseline, the largest value.
        reached: whether the goal is reached.
        missing: package that is not installed, without which it cannot be measured.
    """

    name: str
    unit: str
    ours: tuple[float, ...]
    baseline: tuple[float, ...]
    against: str
    value: float | None
    ratio: float | None
    goal: float
    reached: bool
    missing: str = ""


def run_measures(
    measures: Sequence[Measure], rounds: int, report: Callable[[str], None]
) -> tuple[MeasureResult, ...]:
    """Run every measure in every round, after its baseline, which is timed once per round.

    Args:
        measures: measures to run.
        rounds: number of rounds.
        report: called with a progress message before each measure.

    Raises:
        InvalidValueError: `rounds` is less than 1.
    """
    if rounds < 1:
        raise InvalidValueError(f"rounds is {rounds}; it must be at least 1.")
    ours: list[list[float]] = [[] for _ in measures]
    baselines: list[list[float]] = [[] for _ in measures]
    for number in range(1, rounds + 1):
        timed: dict[Callable[[], float], float] = {}
        for measure, own, base in zip(measures, ours, baselines, strict=True):
            if _is_missing(measure.package):
                continue
            report(f"round {number} of {rounds}: {measure.name}")
            if measure.baseline is not None:
                if measure.baseline not in timed:
                    timed[measure.baseline] = measure.baseline()
                base.append(timed[measure.baseline])
            own.append(measure.ours())
    return tuple(map(_summarize, measures, ours, baselines))


def _summarize(measure: Measure, ours: Sequence[float], baseline: Sequence[float]) -> MeasureResult:
    value = statistics.median(ours) if ours else None
    ratio, reached = None, value is not None and value <= measure.goal
    if baseline and value is not None:
        ratio = statistics.median(baseline) / value
        if measure.inverse:
            ratio = 1.0 / ratio
        reached = ratio >= measure.goal
    return MeasureResult(
        name=measure.name,
        unit=measure.unit,
        ours=tuple(ours),
        baseline=tuple(baseline),
        against=measure.against,
        value=value,
        ratio=ratio,
        goal=measure.goal,
        reached=reached,
        missing="" if ours else measure.package,
    )


def _is_missing(package: str) -> bool:
    return bool(package) and importlib.util.find_spec(package) is None


def results_table(results: Sequence[MeasureResult]) -> Table:
    """Return a table of medians, ratios and goals."""
    table = Table(title=f"{__version__} on {os.cpu_count()} cores", title_justify="left")
    table.add_column("measure")
    for name in ("ours", "baseline", "against", "ratio", "goal", ""):
        table.add_column(name, justify="left" if name == "against" else "right")
    for result in results:
        base = statistics.median(result.baseline) if result.baseline else None
        table.add_row(
            result.name,
            f"{result.missing} is not installed"
            if result.value is None
            else _format_value(result.value, result.unit),
            "" if base is None else _format_value(base, result.unit),
            result.against,
            "" if result.ratio is None else f"{result.ratio:.2f} x",
            f"{'>=' if result.against else '<='} {result.goal:g}",
            "yes" if result.reached else "no",
        )
    return table


def write_results(results: Sequence[MeasureResult], path: Path, load: float) -> None:
    """Write all rounds of all results as JSON, each with its machine, date and load.

    A file of earlier results is kept up to date: what was measured now takes the place of the row
    of the same name, other rows stay.

    Args:
        results: what was measured.
        path: the file.
        load: load average of the five minutes before, which is the load of others.

    Raises:
        InvalidValueError: the file cannot be written, or is no file of results.
    """
    where = {
        "date": dt.datetime.now(dt.UTC).date().isoformat(),
        "machine": f"{os.cpu_count()} cores, {processor_model()}",
        "load": round(load, 1),
        "roboirg": __version__,
    }
    rows = {_key(row): row for row in read_figures(path)} if path.exists() else {}
    for result in results:
        if result.value is not None or _key(asdict(result)) not in rows:
            rows[_key(asdict(result))] = {**asdict(result), **where}
    text = json.dumps({"figures": list(rows.values())}, indent=1)
    try:
        path.write_text(text + "\n", encoding="utf-8")
    except OSError as error:
        raise InvalidValueError(f"{str(path)!r} cannot be written: {error}") from error


def read_figures(path: Path) -> list[dict[str, Any]]:
    """Return the rows of a file that `write_results` wrote.

    Raises:
        InvalidValueError: it is no such file.
    """
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
        if row["value"] is None:
            continue
        base, goal = "", f"at most {row['goal']:g} {row['unit']}"
        if row["ratio"] is not None:
            median = statistics.median(row["baseline"])
            base = f"{_format_value(median, row['unit'])} ({row['against']})"
            goal = f"{row['goal']:g} ×"
        ratio = "" if row["ratio"] is None else f"{row['ratio']:.3g} ×"
        ours = _format_value(row["value"], row["unit"])
        load = "" if row["load"] is None else row["load"]
        cells = (row["name"], ours, base, ratio, goal, row["date"], load)
        lines.append(f"| {' | '.join(map(str, cells))} |")
    return "\n".join(lines) + "\n"


def _key(row: Mapping[str, Any]) -> tuple[str, str, float]:
    return (row["name"], row["against"], row["goal"])


def _format_value(value: float, unit: str) -> str:
    shown = value * _SCALES.get(unit, 1.0)
    return f"{shown:,.0f} {unit}" if shown >= _WHOLE else f"{shown:.3g} {unit}"
