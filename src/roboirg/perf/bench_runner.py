"""Alternating rounds, medians, a table and JSON."""

from __future__ import annotations

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
"""Seconds are told in these units; other figures are told as they are."""


@dataclass(frozen=True)
class MeasureResult:
    """What came of a measure.

    Attributes:
        name: of the measure.
        unit: of the figures; times are in seconds here, whatever the unit.
        ours: of each round.
        baseline: of each round; empty for figures that stand alone.
        against: what the baseline is.
        value: median of ours.
        ratio: of the medians, greater is better; None for figures that stand alone.
        goal: wanted ratio; for figures that stand alone the most wanted.
        reached: whether the goal is.
    """

    name: str
    unit: str
    ours: tuple[float, ...]
    baseline: tuple[float, ...]
    against: str
    value: float
    ratio: float | None
    goal: float
    reached: bool


def run_measures(
    measures: Sequence[Measure], rounds: int, tell: Callable[[str], None]
) -> tuple[MeasureResult, ...]:
    """Every measure in every round, ours after its baseline, which is timed once a round.

    Args:
        measures: what is measured.
        rounds: how often.
        tell: is told what is being measured.

    Raises:
        InvalidValueError: no rounds.
    """
    if rounds < 1:
        raise InvalidValueError(f"rounds is {rounds}; it must be at least 1.")
    ours: list[list[float]] = [[] for _ in measures]
    baselines: list[list[float]] = [[] for _ in measures]
    for number in range(1, rounds + 1):
        known: dict[Callable[[], float], float] = {}
        for measure, own, base in zip(measures, ours, baselines, strict=True):
            tell(f"round {number} of {rounds}: {measure.name}")
            if measure.baseline is not None:
                if measure.baseline not in known:
                    known[measure.baseline] = measure.baseline()
                base.append(known[measure.baseline])
            own.append(measure.ours())
    return tuple(map(_summarize, measures, ours, baselines))


def _summarize(measure: Measure, ours: Sequence[float], baseline: Sequence[float]) -> MeasureResult:
    value, ratio = statistics.median(ours), None
    reached = value <= measure.goal
    if baseline:
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
    )


def results_table(figures: Sequence[MeasureResult]) -> Table:
    """Medians, ratios and goals."""
    shown = Table(title=f"{__version__} on {os.cpu_count()} cores", title_justify="left")
    shown.add_column("measure")
    for name in ("ours", "baseline", "against", "ratio", "goal", ""):
        shown.add_column(name, justify="left" if name == "against" else "right")
    for figure in figures:
        base = statistics.median(figure.baseline) if figure.baseline else None
        shown.add_row(
            figure.name,
            _format_value(figure.value, figure.unit),
            "" if base is None else _format_value(base, figure.unit),
            figure.against,
            "" if figure.ratio is None else f"{figure.ratio:.2f} x",
            f"{'<=' if figure.ratio is None else '>='} {figure.goal:g}",
            "yes" if figure.reached else "no",
        )
    return shown


def write_results(figures: Sequence[MeasureResult], path: Path) -> None:
    """All rounds of all figures, and the machine, as JSON.

    Raises:
        InvalidValueError: the file cannot be written.
    """
    told = {
        "roboirg": __version__,
        "python": platform.python_version(),
        "machine": platform.platform(),
        "cores": os.cpu_count(),
        "figures": [asdict(figure) for figure in figures],
    }
    try:
        path.write_text(json.dumps(told, indent=2) + "\n", encoding="utf-8")
    except OSError as error:
        raise InvalidValueError(f"{str(path)!r} cannot be written: {error}") from error


def _format_value(value: float, unit: str) -> str:
    return f"{value * _SCALES.get(unit, 1.0):.3g} {unit}"
