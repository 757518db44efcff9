"""Write docs/published-figures.md: what the paper's figures support, recomputed from its tables.

python scripts/write_published_figures.py
"""

from __future__ import annotations

import itertools
import math
import textwrap
from collections import defaultdict
from collections.abc import Collection, Iterator, Mapping
from decimal import Decimal
from pathlib import Path
from typing import NamedTuple

import numpy as np
from written_parts import table

from roboirg.analysis.published import (
    TRIALS,
    PublishedRow,
    RateTable,
    published_rows,
    published_tasks,
    unpaired_rates,
)
from roboirg.language.settings import EXPLICIT
from roboirg.stats.intervals import (
    Interval,
    critical_value,
    interval_of_values,
    mean_interval,
    ratio_interval,
)

PAGE = Path(__file__).parent.parent / "docs" / "published-figures.md"
IMPLICIT = ("direct", "reasoning", "contextual", "spatial")
DIRECT = "direct"
REASONING = "reasoning"
SPATIAL = "spatial"
CELL = math.prod(TRIALS["main"])
"""Trials of a cell of the main, planner and context tables."""
MODEL = "MemER"
"""Is in every table, and has the tasks, settings and stages of all models."""


def rows_of(kind: RateTable) -> Mapping[str, Mapping[str, PublishedRow]]:
    """Return each model's rows of a table by setting, or by stages in the table of contexts."""
    rows: dict[str, dict[str, PublishedRow]] = defaultdict(dict)
    for row in published_rows(kind):
        condition = row.options.setting
        if kind == "context":
            condition = ",".join(map(str, row.options.stages))
        rows[row.model][condition] = row
    return rows


def defined_tasks(row: PublishedRow) -> tuple[str, ...]:
    """Return the tasks for which a row has a rate."""
    return tuple(task for task, rate in row.rates.items() if rate is not None)


def shared_tasks() -> tuple[str, ...]:
    """Return the tasks of the main table that have every setting."""
    return defined_tasks(rows_of("main")[MODEL][SPATIAL])


def average(row: PublishedRow, tasks: Collection[str]) -> Decimal:
    """Return the mean of a row over tasks that all have a rate."""
    found = row.average_over(tasks)
    if found is None:
        raise ValueError(f"{row.model} has no rate in some of {', '.join(tasks)}")
    return found


class Comparison(NamedTuple):
    """Two published rows over the same tasks.

    Attributes:
        first: mean of the first, percent.
        second: mean of the second, percent.
        interval: of the second less the first; both are 0 to 1 here.
        kept: the second as a share of the first.
        kept_interval: of that share.
    """

    first: Decimal
    second: Decimal
    interval: Interval
    kept: float
    kept_interval: Interval

    @property
    def change(self) -> Decimal:
        """The second less the first."""
        return self.second - self.first

    @property
    def is_clear(self) -> bool:
        """Whether the interval leaves out zero."""
        return self.interval.low > 0 or self.interval.high < 0


def compare(first: PublishedRow, second: PublishedRow, tasks: Collection[str]) -> Comparison:
    """Compare two rows over tasks, with the intervals of our tables.

    Single trials are not published, so that every trial counts as an episode of its own.
    """
    rates = unpaired_rates(second.rates, first.rates, tasks, CELL)
    part = 1 / len(tasks)  # of the mean over tasks
    change = mean_interval([task.combined(part, -part) for task in rates])
    kept_interval = ratio_interval(rates)
    if change is None or kept_interval is None:
        raise ValueError("a cell has too few trials for an interval")
    first_mean = average(first, tasks)
    second_mean = average(second, tasks)
    kept = float(second_mean / first_mean)
    return Comparison(first_mean, second_mean, change, kept, kept_interval)


def half_width(percent: int, trials: int) -> str:
    """Return half the width of the interval of a cell's rate, in points."""
    outcomes = np.arange(trials) < percent * trials // 100
    interval = interval_of_values([outcomes])
    if interval is None:
        raise ValueError("a cell has too few trials for an interval")
    return f"{50 * (interval.high - interval.low):.0f}"


def page() -> str:
    """Return the whole page, in Markdown."""
    blocks = [_INTRODUCTION]
    for part in (_spatial, _starts, _trend, _hardest, _kept, _widths):
        blocks += part()
    return "\n\n".join(blocks) + "\n"


_INTRODUCTION = """\
# What the paper's figures support

*Written by `scripts/write_published_figures.py`; do not edit.*

The paper prints success rates without intervals. This page computes from these rates, with the
statistics of our own tables, what can be said from them. It is no criticism of the experiments:
those who build on a number need to know how firm it is. The rates are the paper's, from its systems
in its simulator; all are in the
[published results](../src/roboirg/analysis/published_results/README.md).

Intervals are 95 %, the [score intervals](statistics.md) of our tables. Single trials are not
published, so rows are compared unpaired, and the 150 trials of a cell (50 episodes, each with three
seeds) count as independent. The seeds of an episode are alike, so true intervals are wider, up to
1.7 times if all seeds agree; pairing would narrow them. **Bold** changes have an interval without
zero."""


def _text(*sentences: str) -> str:
    return textwrap.fill(" ".join(sentences), 118, break_on_hyphens=False, break_long_words=False)


def _signed(comparison: Comparison) -> str:
    text = "0.00"
    if comparison.change:
        text = f"{comparison.change:+}"
    if comparison.is_clear:
        text = f"**{text}**"
    low, high = comparison.interval
    return f"{text} ({100 * low:+.1f} to {100 * high:+.1f})".replace("-", "−")


def _spatial() -> Iterator[str]:
    lines = []
    for model, rows in rows_of("main").items():
        explicit = rows[EXPLICIT]
        spatial = rows[SPATIAL]
        change = compare(explicit, spatial, shared_tasks())
        drop = explicit.average - spatial.average
        cells = (explicit.average, change.first, change.second, drop, _signed(change))
        lines.append((model, *cells))
    every = len(published_tasks("main"))
    some = len(shared_tasks())
    yield f"## Spatial: {some} tasks against {every}"
    yield _text(
        f"The spatial setting exists for {some} tasks. The printed change of its average is from",
        f"the explicit average of all {every}; on the same tasks every drop is larger. Our tables",
        "compare the same tasks.",
    )
    heads = (
        "model", "explicit, all tasks", "explicit, same tasks", "spatial", "drop as printed",
        "change on the same tasks",
    )  # fmt: skip
    yield table(heads, lines)


def _starts() -> Iterator[str]:
    direct = rows_of("main")
    staged = rows_of("context")
    lines = []
    differing = 0
    clear = 0
    for model, task in itertools.product(staged, published_tasks("context")):
        change = compare(direct[model][DIRECT], staged[model]["1,5"], (task,))
        lines.append((model, task, change.first, change.second, _signed(change)))
        differing += change.change != 0
        clear += change.is_clear
    yield "## Context: where it starts"
    yield _text(
        "Introduction and command alone, stages 1 and 5, are what the direct setting says. The",
        "ablation's row with these stages differs from the main table's direct row in",
        f"{differing} of {len(lines)} cells; in {clear} the",
        "interval leaves out zero. Either the words are others, or two runs of the same differ",
        "this much: the figures cannot say which.",
    )
    yield table(("model", "task", "direct", "stages 1,5", "change"), lines)


def _trend() -> Iterator[str]:
    tasks = published_tasks("context")
    all_rows = rows_of("context")
    stages = list(all_rows[MODEL])
    steps = []
    lines = []
    for model, rows in all_rows.items():
        cells = [model]
        for before, after in itertools.pairwise(stages):
            change = compare(rows[before], rows[after], tasks)
            steps.append(change)
            cells.append(f"{change.first} → {change.second}: {_signed(change)}")
        whole = compare(rows[stages[0]], rows[stages[-1]], tasks)
        lines.append((*cells, _signed(whole)))
    rises = sum(step.change > 0 for step in steps)
    clear = sum(step.is_clear for step in steps)
    yield "## Context: does success fall with every stage?"
    yield _text(
        f"Of {len(steps)} steps to one more stage, {rises} are up, and",
        f"{clear or 'none'} has an interval without zero.",
        "From the shortest context to the longest every model falls.",
    )
    heads = [f"{before} → {after}" for before, after in itertools.pairwise(stages)]
    yield table(("model", *heads, "first to last"), lines)


def _hardest() -> Iterator[str]:
    shared = shared_tasks()
    lines = []
    hardest = 0
    hardest_shared = 0
    for model, rows in rows_of("main").items():
        lowest = min(IMPLICIT, key=lambda setting: rows[setting].average)
        lowest_shared = min(IMPLICIT, key=lambda setting: average(rows[setting], shared))
        change = compare(rows[REASONING], rows[SPATIAL], shared)
        cells = (change.first, change.second, _signed(change))
        lines.append((model, lowest, lowest_shared, *cells))
        hardest += lowest == REASONING
        hardest_shared += lowest_shared == REASONING
    yield "## Is reasoning always the hardest?"
    yield _text(
        f"Reasoning has the lowest average of {hardest} of {len(lines)} models; on",
        f"the {len(shared)} tasks that have every setting, of",
        f"{hardest_shared}. The last columns compare it",
        "with spatial on these tasks: above zero, spatial is easier.",
    )
    heads = ("model", "lowest, as printed", "lowest, same tasks", REASONING, SPATIAL, "change")
    yield table(heads, lines)


def _kept() -> Iterator[str]:
    changed = []
    kept = []
    small = []
    for model, rows in rows_of("main").items():
        changed_cells = [model]
        kept_cells = [model]
        for setting in IMPLICIT:
            change = compare(rows[EXPLICIT], rows[setting], defined_tasks(rows[setting]))
            low, high = change.kept_interval
            changed_cells.append(_signed(change))
            kept_cells.append(f"{100 * change.kept:.0f} ({100 * low:.0f} to {100 * high:.0f})")
            if setting == DIRECT and not change.is_clear:
                small.append(model)
        changed.append(changed_cells)
        kept.append(kept_cells)
    heads = ("model", *IMPLICIT)
    yield "## What each model loses, and keeps"
    yield "Points from explicit, on the tasks that have the setting:"
    yield table(heads, changed)
    yield _text(
        f"In the direct setting the changes of {', '.join(small)} have an interval with zero: not",
        "every model loses much there, with memory or without.",
    )
    yield "Percent of the explicit rate that is kept:"
    yield table(heads, kept)
    yield _text(
        "Of the two systems that plan in words, GroundSG-QwenVL keeps most, and MemER less than",
        "pi0.5, which has no memory, in the first three settings. A low explicit rate is",
        "also easier to keep: near what chance gives, there is little to lose.",
    )


def _widths() -> Iterator[str]:
    real, _ = TRIALS["real"]
    usual = f"{half_width(10, CELL)} to {half_width(50, CELL)}"
    yield "## How wide is a cell?"
    yield table(
        ("table", "trials of a cell", "half the 95 % interval, points"),
        [
            ("main, planner, context", CELL, f"{usual} (10 to 90 %)"),
            ("real world", real, f"{half_width(50, real)} (50 %)"),
        ],
    )
    apart = 100 * critical_value() * math.sqrt(2 * 0.25 / CELL)
    yield _text(
        f"Two cells of {CELL} trials near 50 % differ by chance alone by up to {apart:.0f} points",
        "in 95 of 100 cases.",
    )


if __name__ == "__main__":
    PAGE.write_text(page(), encoding="utf-8")
