"""Runs measures in alternating rounds; reports medians as a table and JSON."""

from __future__ import annotations

import datetime as dt
import importlib.util
import json
import os
import platform
import statistics
from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path

from rich.table import Table

from roboirg.core.errors import InvalidValueError
from roboirg.core.version import __version__
from roboirg.perf.measures import Measure

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


def write_results(results: Sequence[MeasureResult], path: Path) -> None:
    """Write all rounds of all results, the machine, and the processes that it had to run, as JSON.

    Raises:
        InvalidValueError: the file cannot be written.
    """
    content = {
        "roboirg": __version__,
        "python": platform.python_version(),
        "machine": platform.platform(),
        "processor": _processor(),
        "cores": os.cpu_count(),
        "load": round(os.getloadavg()[1], 1),
        "date": dt.datetime.now(dt.UTC).date().isoformat(),
        "figures": [asdict(result) for result in results],
    }
    try:
        path.write_text(json.dumps(content, indent=2) + "\n", encoding="utf-8")
    except OSError as error:
        raise InvalidValueError(f"{str(path)!r} cannot be written: {error}") from error


def _processor() -> str:
    """Return the model of the processor; empty where the system does not tell."""
    try:
        lines = Path("/proc/cpuinfo").read_text(encoding="utf-8").splitlines()
    except OSError:
        return platform.processor()
    names = (line.partition(":")[2].strip() for line in lines if line.startswith("model name"))
    return next(names, platform.processor())


def _format_value(value: float, unit: str) -> str:
    return f"{value * _SCALES.get(unit, 1.0):.3g} {unit}"
