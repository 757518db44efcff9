"""Runs measures in alternating rounds; reports medians as a table and all rounds as JSON."""

from __future__ import annotations

import datetime as dt
import json
import os
import statistics
from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from rich.table import Table

from roboirg.core.errors import InvalidValueError
from roboirg.core.version import __version__
from roboirg.util.processor import processor_model

_WHOLE = 1000
"""From here on values are shown as whole numbers."""
_SCALES = {"ms": 1e3}
"""Factors from stored to displayed units; other units have factor 1."""


@dataclass(frozen=True)
class Measure:
    """One measure.

    Attributes:
        name: what is measured.
        ours: returns seconds, or a figure in `unit`.
        baseline: returns the same for the baseline; None for measures without one.
        against: name of the baseline.
        unit: unit in tables; of a rate ("1/s", "1/h") more is better, of others less.
    """

    name: str
    ours: Callable[[], float]
    baseline: Callable[[], float] | None
    against: str
    unit: str = "ms"


@dataclass(frozen=True)
class MeasureResult:
    """The result of a measure.

    Attributes:
        name: name of the measure.
        unit: unit in tables; stored times are in seconds.
        ours: result of each round.
        baseline: baseline of each round; empty for measures without one.
        against: name of the baseline.
    """

    name: str
    unit: str
    ours: tuple[float, ...]
    baseline: tuple[float, ...]
    against: str

    @property
    def value(self) -> float:
        """Median of `ours`."""
        return statistics.median(self.ours)

    @property
    def ratio(self) -> float | None:
        """Ratio of the medians, greater is better; None without a baseline."""
        if not self.baseline:
            return None
        ratio = self.value / statistics.median(self.baseline)
        return ratio if self.unit.startswith("1/") else 1.0 / ratio

    def as_json(self) -> dict[str, Any]:
        """Return all rounds and both figures."""
        return {**asdict(self), "value": self.value, "ratio": self.ratio}


def run_measures(
    measures: Sequence[Measure], rounds: int, report: Callable[[str], None]
) -> tuple[MeasureResult, ...]:
    """Run every measure in every round, after its baseline, which is timed once per round."""
    if rounds < 1:
        raise InvalidValueError(f"rounds is {rounds}; it must be at least 1.")
    ours: list[list[float]] = [[] for _ in measures]
    baselines: list[list[float]] = [[] for _ in measures]
    for number in range(1, rounds + 1):
        timed: dict[Callable[[], float], float] = {}
        for measure, own, base in zip(measures, ours, baselines, strict=True):
            report(f"round {number} of {rounds}: {measure.name}")
            if measure.baseline is not None:
                if measure.baseline not in timed:
                    timed[measure.baseline] = measure.baseline()
                base.append(timed[measure.baseline])
            own.append(measure.ours())
    return tuple(
        MeasureResult(one.name, one.unit, tuple(own), tuple(base), one.against)
        for one, own, base in zip(measures, ours, baselines, strict=True)
    )


def results_table(results: Sequence[MeasureResult]) -> Table:
    """Return a table of medians and ratios."""
    table = Table(title=f"{__version__} on {os.cpu_count()} cores", title_justify="left")
    table.add_column("measure")
    for name in ("ours", "baseline", "against", "ratio"):
        table.add_column(name, justify="left" if name == "against" else "right")
    for result in results:
        base = statistics.median(result.baseline) if result.baseline else None
        table.add_row(
            result.name,
            format_value(result.value, result.unit),
            "" if base is None else format_value(base, result.unit),
            result.against,
            "" if result.ratio is None else f"{result.ratio:.2f} x",
        )
    return table


def write_json(figures: Sequence[dict[str, Any]], path: Path) -> None:
    text = json.dumps({"figures": figures}, indent=1)
    try:
        path.write_text(text + "\n", encoding="utf-8")
    except OSError as error:
        raise InvalidValueError(f"{str(path)!r} cannot be written: {error}") from error


def circumstances(load: float) -> dict[str, Any]:
    """Return date, machine, load and version, which figures are stored with."""
    return {
        "date": dt.datetime.now(dt.UTC).date().isoformat(),
        "machine": f"{os.cpu_count()} cores, {processor_model()}",
        "load": round(load, 1),
        "roboirg": __version__,
    }


def format_value(value: float, unit: str) -> str:
    shown = value * _SCALES.get(unit, 1.0)
    return f"{shown:,.0f} {unit}" if shown >= _WHOLE else f"{shown:.3g} {unit}"
