"""Results of the paper, to compare a run with. Source: ``published_results/README.md``."""

from __future__ import annotations

import csv
import functools
from collections.abc import Collection, Mapping
from dataclasses import replace
from decimal import Decimal
from fractions import Fraction
from importlib import resources
from typing import Literal, NamedTuple, cast

import numpy as np

from roboirg.analysis.results.option_labels import staged_options
from roboirg.core.instruction_options import InstructionOptions, options_label
from roboirg.stats.intervals import TaskRates
from roboirg.stats.rates import DIGITS, mean_percent

RateTable = Literal["main", "planner", "context", "real", "harder", "other"]
"""The tables of success rates; ``other`` holds the tasks that the paper does not have, ``harder``
the settings."""
RATE_TABLES: tuple[RateTable, ...] = ("main", "planner", "context", "real")
"""Those of the paper."""

AVERAGE = "Avg"


class Trials(NamedTuple):
    """How many episodes and model seeds are behind every rate of a table."""

    episodes: int
    seeds: int


TRIALS: Mapping[RateTable, Trials] = {
    "main": Trials(50, 3),
    "planner": Trials(50, 3),
    "context": Trials(50, 3),
    "real": Trials(10, 1),
}
PUBLISHED_MAX_STEPS = 1300
"""Control steps that the published policies had."""

_SIMULATED = (
    "(published): from the paper, 50 episodes × 3 seeds per cell, played in its own simulator. It "
    "prints no intervals; at 50 % a cell's is ±8 points."
)
NOTES: Mapping[RateTable, tuple[str, ...]] = {
    "main": (
        f"{_SIMULATED} Averages of suites, where they are shown, are ours.",
        (
            "The paper compares its spatial averages, which are over fewer tasks, with the "
            "explicit ones over all. Drops as printed, and on the same tasks, as in this table: "
            "pi0.5 10.35 and 14.48, TTT-Expert 7.38 and 10.86, FrameS-Modul 25.92 and 26.48, "
            "GroundSG-QwenVL 11.70 and 17.91, MemER 16.62 and 29.04."
        ),
    ),
    "planner": (_SIMULATED,),
    "context": (
        _SIMULATED,
        (
            "The published rows with the shortest context differ from the paper's direct setting "
            "in 8 of 9 cells, by up to 14.00 points."
        ),
    ),
    "real": (
        (
            "(published): from the paper, 10 trials per cell, on its own robot. It prints no "
            "intervals; at 50 % a cell's is ±29 points."
        ),
    ),
}
"""What tables say of the published rates; their numbers never change."""

_FILES = {"main": "main", "planner": "planner", "context": "context", "real": "real_world"}


class PublishedRow(NamedTuple):
    """One row of a published table.

    Attributes:
        model: the policy, or its planner in the table of planners.
        options: of the instructions.
        rates: percent by task; None if the setting is not defined for the task.
        average: as printed.
    """

    model: str
    options: InstructionOptions
    rates: Mapping[str, Decimal | None]
    average: Decimal

    @property
    def label(self) -> str:
        """Its options, as tables and the column ``instruction_options`` of results name them."""
        return options_label(self.options)

    def average_over(self, tasks: Collection[str]) -> Decimal | None:
        """Return the mean of a published model's rates over some tasks, in percent.

        None without tasks, or if one of them has no rate.
        """
        rates = []
        for task in tasks:
            rate = self.rates.get(task)
            if rate is None:
                return None
            rates.append(rate)
        if not rates:
            return None
        defined = [task for task, rate in self.rates.items() if rate is not None]
        if set(defined) == set(tasks):
            return self.average  # as the paper printed it
        return mean_percent(rates)


@functools.cache
def published_rows(table: str) -> tuple[PublishedRow, ...]:
    """Return the rows of one of the paper's tables, each with a model's rates by task.

    They are read from a file with a line for each rate, that of a task or the average, and stay in
    the order of the paper. A rate is in percent; None where a task does not have the setting.
    """
    rates_by_row: dict[tuple[str, InstructionOptions], dict[str, Decimal | None]] = {}
    for line in published_lines(_FILES[table]):
        model = line.get("model") or line["planner"]
        text = line["success_rate_percent"]
        rate = None
        if text:
            rate = Decimal(text).quantize(DIGITS)
        rates_by_row.setdefault((model, _options(line)), {})[line["task"]] = rate

    rows = []
    for (model, options), rates in rates_by_row.items():
        average = cast("Decimal", rates.pop(AVERAGE))  # every row has one
        rows.append(PublishedRow(model, options, rates, average))
    return tuple(rows)


def unpaired_rates(
    first: Mapping[str, Decimal | None],
    second: Mapping[str, Decimal | None],
    tasks: Collection[str],
    trials: int,
) -> list[TaskRates]:
    """Return the rates of two published rows, which are 0 in each other's trials.

    Single trials are not published, so each counts as an episode of its own, and the two rows of a
    task are two tasks, one after the other.

    Args:
        first: percent by task.
        second: percent by task.
        tasks: which tasks; both rows have a rate in each.
        trials: behind each rate.
    """
    found = []
    for task in tasks:
        for number, rates in enumerate((first, second)):
            successes = round(Fraction(rates[task] or 0) * trials / 100)
            rows = np.zeros((trials, 4), dtype=np.int64)
            rows[:successes, 2 * number] = 1
            rows[:, 2 * number + 1] = 1
            found.append(TaskRates.of(rows))
    return found


def published_tasks(table: str) -> tuple[str, ...]:
    """Return the tasks of a table, in the order of the paper."""
    return tuple(published_rows(table)[0].rates)


def _options(line: Mapping[str, str]) -> InstructionOptions:
    """Return the options of a line; in the table of contexts these are stages, such as ``1,5``."""
    if "stages" in line:
        stages = tuple(map(int, line["stages"].split(",")))
        return replace(staged_options()[0], stages=stages)
    return InstructionOptions(line["setting"])


def published_lines(name: str) -> list[dict[str, str]]:
    """Return the lines of a file, in the order of the paper."""
    path = resources.files("roboirg.analysis") / "published_results" / f"{name}.csv"
    return list(csv.DictReader(path.read_text(encoding="utf-8").splitlines()))
