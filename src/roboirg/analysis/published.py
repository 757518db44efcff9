"""The paper's own figures, to stand beside a run's. Their source: ``published/README.md``."""

from __future__ import annotations

import csv
import functools
from collections.abc import Mapping
from decimal import Decimal
from importlib import resources
from typing import Literal, NamedTuple, get_args

from roboirg.analysis.stats.rates import DIGITS
from roboirg.analysis.stats.success_rates import EXPLICIT, SettingColumn
from roboirg.core.errors import UnknownNameError

RateTable = Literal["main", "planner", "context", "real"]
RATE_TABLES: tuple[RateTable, ...] = get_args(RateTable)

Covers = Literal["yes", "no", "partial"]

AVERAGE = "Avg"
TRIALS: Mapping[RateTable, tuple[int, int]] = {
    "main": (50, 3),
    "planner": (50, 3),
    "context": (50, 3),
    "real": (10, 1),
}
"""Episodes, and model seeds on each of them, behind every published rate."""

_FILES = {"main": "main", "planner": "planner", "context": "context", "real": "real_world"}
_MODEL_COLUMNS = ("model", "planner")


class PublishedRow(NamedTuple):
    """One row of a published table.

    Attributes:
        model: the policy, or its planner where planners are compared.
        variant: how it was told.
        rates: percent by task; None where the setting is not defined for the task.
        average: as printed.
    """

    model: str
    variant: SettingColumn
    rates: Mapping[str, Decimal | None]
    average: Decimal


class CoverageRow(NamedTuple):
    """Which kinds of implicit reference a benchmark has.

    Attributes:
        benchmark: its name.
        kind: manipulation or memory.
        covers: by setting.
    """

    benchmark: str
    kind: str
    covers: Mapping[str, Covers]


@functools.cache
def published_rows(table: str) -> tuple[PublishedRow, ...]:
    """The rows of a table, in the order of the paper.

    Raises:
        UnknownNameError: there is no such table.
    """
    if table not in RATE_TABLES:
        raise UnknownNameError("published table", table, RATE_TABLES)
    grouped: dict[tuple[str, SettingColumn], dict[str, Decimal | None]] = {}
    for line in _lines(_FILES[table]):
        model = next(line[column] for column in _MODEL_COLUMNS if column in line)
        text = line["success_rate_percent"]
        rate = Decimal(text).quantize(DIGITS) if text else None
        grouped.setdefault((model, _variant(line)), {})[line["task"]] = rate
    rows = []
    for (model, variant), rates in grouped.items():
        average = rates.pop(AVERAGE)
        if average is None:
            raise ValueError(f"{table}.csv has no average of {model}, {variant.label}")
        rows.append(PublishedRow(model, variant, rates, average))
    return tuple(rows)


def published_tasks(table: str) -> tuple[str, ...]:
    """The tasks of a table, in the order of the paper."""
    return tuple(published_rows(table)[0].rates)


@functools.cache
def published_coverage() -> tuple[CoverageRow, ...]:
    """Which benchmark covers what, in the order of the paper."""
    rows = []
    for line in _lines("coverage"):
        benchmark, kind = line.pop("benchmark"), line.pop("kind")
        rows.append(CoverageRow(benchmark, kind, {name: _covers(line[name]) for name in line}))
    return tuple(rows)


def _variant(line: Mapping[str, str]) -> SettingColumn:
    if "stages" in line:
        stages = tuple(map(int, line["stages"].split(",")))
        return SettingColumn("contextual", stages=stages)
    return EXPLICIT._replace(setting=line["setting"])


def _covers(word: str) -> Covers:
    for known in get_args(Covers):
        if word == known:
            covers: Covers = known
            return covers
    raise ValueError(f"coverage.csv says {word!r}")


def _lines(name: str) -> list[dict[str, str]]:
    path = resources.files("roboirg.analysis") / "published_results" / f"{name}.csv"
    return list(csv.DictReader(path.read_text(encoding="utf-8").splitlines()))
