"""Write docs/published-figures.md: what the paper's figures support, recomputed from its tables.

python scripts/write_published_figures.py
"""

from __future__ import annotations

import itertools
import math
import textwrap
from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from decimal import Decimal
from fractions import Fraction
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from roboirg.analysis.published import (
    TRIALS,
    PublishedRow,
    RateTable,
    published_rows,
    published_tasks,
)
from roboirg.analysis.results.option_labels import staged_options
from roboirg.language.settings import EXPLICIT
from roboirg.stats.intervals import (
    SEED,
    Z_95,
    Interval,
    percentile_interval,
    resampled_rates,
    wilson_interval,
)

PAGE = Path(__file__).parent.parent / "docs" / "published-figures.md"
IMPLICIT = ("direct", "reasoning", "contextual", "spatial")
DIRECT, REASONING, SPATIAL = "direct", "reasoning", "spatial"
CELL = math.prod(TRIALS["main"])
"""Trials of a cell of the main, planner and context tables."""


def rows_of(table: RateTable) -> Mapping[tuple[str, str], PublishedRow]:
    """Return the rows of a table by model and setting, or stages in the table of contexts."""
    return {(row.model, _condition(table, row)): row for row in published_rows(table)}


def _condition(table: RateTable, row: PublishedRow) -> str:
    if table == "context":
        return ",".join(map(str, row.options.stages))
    return row.options.setting


def models_of(table: RateTable) -> tuple[str, ...]:
    """Return the models of a table, in its order."""
    return tuple(dict.fromkeys(row.model for row in published_rows(table)))


def defined_tasks(row: PublishedRow) -> tuple[str, ...]:
    """Return the tasks for which a row has a rate."""
    return tuple(task for task, rate in row.rates.items() if rate is not None)


def average(row: PublishedRow, tasks: Collection[str]) -> Decimal:
    """Return the mean of a row over tasks that all have a rate."""
    found = row.average_over(tasks)
    if found is None:
        raise ValueError(f"{row.model} has no rate in some of {', '.join(tasks)}")
    return found


class Comparison(NamedTuple):
    """Two published rows over the same tasks, in points.

    Attributes:
        first: mean of the first.
        second: mean of the second.
        interval: of the second less the first.
        kept: the second as a share of the first, with its interval, percent.
    """

    first: Decimal
    second: Decimal
    interval: Interval
    kept: tuple[float, Interval]

    @property
    def change(self) -> Decimal:
        """The second less the first."""
        return self.second - self.first

    @property
    def is_clear(self) -> bool:
        """Whether the interval leaves out zero."""
        return self.interval.low > 0 or self.interval.high < 0


def compare(first: PublishedRow, second: PublishedRow, tasks: Collection[str]) -> Comparison:
    """Compare two rows over tasks, with the bootstrap of our tables.

    Single trials are not published, so that the two rows are resampled apart, and every trial
    counts as an episode of its own.
    """
    rng = np.random.default_rng(SEED)
    drawn = [100 * resampled_rates(_trials(row, tasks), rng)[:, 0] for row in (first, second)]
    sizes = [CELL] * len(tasks)
    change = percentile_interval(drawn[1] - drawn[0], sizes)
    kept = percentile_interval(100 * drawn[1] / drawn[0], sizes)
    if change is None or kept is None:
        raise ValueError("a cell has too few trials for an interval")
    means = average(first, tasks), average(second, tasks)
    return Comparison(*means, change, (100 * float(means[1] / means[0]), kept))


def _trials(row: PublishedRow, tasks: Collection[str]) -> list[NDArray[np.int64]]:
    """Return a line for each trial of each task, (trials, 2): its success, and 1."""
    found = []
    for task in tasks:
        rate = row.rates[task] or Fraction(0)
        won = round(Fraction(rate) * CELL / 100)
        found.append(np.column_stack([np.arange(CELL) < won, np.ones(CELL)]).astype(np.int64))
    return found


def spatial_drops() -> dict[str, tuple[Decimal, Comparison]]:
    """Return each model's spatial drop as printed, and the comparison on the same tasks."""
    rows, found = rows_of("main"), {}
    for model in models_of("main"):
        explicit, spatial = rows[model, EXPLICIT], rows[model, SPATIAL]
        same = compare(explicit, spatial, defined_tasks(spatial))
        found[model] = explicit.average - spatial.average, same
    return found


def lowest_settings(tasks: Collection[str] | None = None) -> dict[str, str]:
    """Return the implicit setting with the lowest average of each model, on some tasks."""
    rows = rows_of("main")
    found = {}
    for model in models_of("main"):
        means = {
            name: average(row, tasks or defined_tasks(row))
            for name in IMPLICIT
            if (row := rows[model, name])
        }
        found[model] = min(means, key=lambda name: means[name])
    return found


def shortest_context() -> list[tuple[str, str, Comparison]]:
    """Return for each model and task the direct setting beside the shortest context."""
    direct, staged = rows_of("main"), rows_of("context")
    shortest = ",".join(map(str, staged_options()[0].stages))
    return [
        (model, task, compare(direct[model, DIRECT], staged[model, shortest], (task,)))
        for model in models_of("context")
        for task in published_tasks("context")
    ]


def context_steps() -> list[tuple[str, str, str, Comparison]]:
    """Return each model's average before and after every further stage."""
    rows, tasks = rows_of("context"), published_tasks("context")
    stages = [",".join(map(str, one.stages)) for one in staged_options()]
    return [
        (model, before, after, compare(rows[model, before], rows[model, after], tasks))
        for model in models_of("context")
        for before, after in itertools.pairwise(stages)
    ]


def setting_changes() -> dict[tuple[str, str], Comparison]:
    """Return each implicit setting beside explicit, on the tasks that have it."""
    rows = rows_of("main")
    return {
        (model, name): compare(rows[model, EXPLICIT], row, defined_tasks(row))
        for model in models_of("main")
        for name in IMPLICIT
        if (row := rows[model, name])
    }


def half_widths() -> list[tuple[Decimal, float]]:
    """Return the rates of the main table with half the width of their intervals, points."""
    rates = {rate for row in published_rows("main") for rate in row.rates.values() if rate}
    found = []
    for rate in sorted(rates):
        low, high = wilson_interval(round(Fraction(rate) * CELL / 100), CELL)
        found.append((rate, 50 * (high - low)))
    return found


def page() -> str:
    """Return the whole page, in Markdown."""
    parts = (_spatial(), _starts(), _trend(), _hardest(), _kept(), _widths())
    return "\n\n".join([_INTRODUCTION, *(block for part in parts for block in part)]) + "\n"


_INTRODUCTION = """\
# What the paper's figures support

*Written by `scripts/write_published_figures.py`; do not edit.*

The paper prints success rates without intervals. This page computes from these rates, with the
statistics of our own tables, what can be said from them. It is no criticism of the experiments:
those who build on a number need to know how firm it is. The rates are the paper's, from its systems
in its simulator; all are in the
[published results](../src/roboirg/analysis/published_results/README.md).

Intervals are 95 %, by the [bootstrap](statistics.md) of our tables. Single trials are not
published, so rows are compared unpaired, and the 150 trials of a cell (50 episodes, each with three
seeds) count as independent. The seeds of an episode are alike, so true intervals are wider, up to
1.7 times if all seeds agree; pairing would narrow them. **Bold** changes have an interval without
zero."""


def _text(*sentences: str) -> str:
    return textwrap.fill(" ".join(sentences), 118, break_on_hyphens=False, break_long_words=False)


def _table(heads: Sequence[object], rows: Iterable[Sequence[object]]) -> str:
    lines = [heads, ["---"] * len(heads), *rows]
    return "\n".join(f"| {' | '.join(map(str, line))} |" for line in lines)


def _signed(one: Comparison) -> str:
    text = f"{one.change:+}".replace("-", "−") if one.change else "0.00"
    low, high = (f"{end:+.1f}".replace("-", "−") for end in one.interval)
    return f"{f'**{text}**' if one.is_clear else text} ({low} to {high})"


def _spatial() -> Iterator[str]:
    drops, rows = spatial_drops(), rows_of("main")
    every = len(published_tasks("main"))
    some = len(defined_tasks(rows[next(iter(drops)), SPATIAL]))
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
    yield _table(
        heads,
        [
            (model, rows[model, EXPLICIT].average, one.first, one.second, printed, _signed(one))
            for model, (printed, one) in drops.items()
        ],
    )
    printed = sorted(drops, key=lambda model: drops[model][0])
    same = sorted(drops, key=lambda model: -drops[model][1].change)
    yield _text(
        f"From the smallest drop to the largest, as printed: {', '.join(printed)};",
        f"on the same tasks: {', '.join(same)}.",
    )


def _starts() -> Iterator[str]:
    cells = shortest_context()
    differ = [one for *_, one in cells if one.change]
    yield "## Context: where it starts"
    yield _text(
        "Introduction and command alone, stages 1 and 5, are what the direct setting says. The",
        "ablation's row with these stages differs from the main table's direct row in",
        f"{len(differ)} of {len(cells)} cells; in {sum(one.is_clear for one in differ)} the",
        "interval leaves out zero. Either the words are others, or two runs of the same differ",
        "this much: the figures cannot say which.",
    )
    yield _table(
        ("model", "task", "direct", "stages 1,5", "change"),
        [(model, task, one.first, one.second, _signed(one)) for model, task, one in cells],
    )


def _trend() -> Iterator[str]:
    rows, tasks, steps = rows_of("context"), published_tasks("context"), context_steps()
    rises = [one for *_, one in steps if one.change > 0]
    yield "## Context: does success fall with every stage?"
    yield _text(
        f"Of {len(steps)} steps to one more stage, {len(rises)} are up, and",
        f"{sum(one.is_clear for *_, one in steps) or 'none'} has an interval without zero.",
        "From the shortest context to the longest every model falls.",
    )
    heads = [f"{before} → {after}" for _, before, after, _ in steps[:3]]
    lines = []
    for model in models_of("context"):
        own = [one for one in steps if one[0] == model]
        whole = compare(rows[model, own[0][1]], rows[model, own[-1][2]], tasks)
        changes = [f"{one.first} → {one.second}: {_signed(one)}" for *_, one in own]
        lines.append((model, *changes, _signed(whole)))
    yield _table(("model", *heads, "first to last"), lines)


def _hardest() -> Iterator[str]:
    rows = rows_of("main")
    shared = defined_tasks(rows[models_of("main")[0], SPATIAL])
    lowest, on_shared = lowest_settings(), lowest_settings(shared)
    count = sum(name == REASONING for name in lowest.values())
    yield "## Is reasoning always the hardest?"
    yield _text(
        f"Reasoning has the lowest average of {count} of {len(lowest)} models; on the",
        f"{len(shared)} tasks that have every setting, of",
        f"{sum(name == REASONING for name in on_shared.values())}. The last columns compare it",
        "with spatial on these tasks: above zero, spatial is easier.",
    )
    lines = []
    for model in models_of("main"):
        one = compare(rows[model, REASONING], rows[model, SPATIAL], shared)
        lines.append((model, lowest[model], on_shared[model], one.first, one.second, _signed(one)))
    heads = "model", "lowest, as printed", "lowest, same tasks", REASONING, SPATIAL, "change"
    yield _table(heads, lines)


def _kept() -> Iterator[str]:
    changes = setting_changes()
    yield "## What each model loses, and keeps"
    yield "Points from explicit, on the tasks that have the setting:"
    yield _by_setting({key: _signed(one) for key, one in changes.items()})
    small = [model for (model, name), one in changes.items() if name == DIRECT and not one.is_clear]
    yield _text(
        f"In the direct setting the changes of {', '.join(small)} have an interval with zero: not",
        "every model loses much there, with memory or without.",
    )
    yield "Percent of the explicit rate that is kept:"
    yield _by_setting(
        {
            key: f"{one.kept[0]:.0f} ({one.kept[1].low:.0f} to {one.kept[1].high:.0f})"
            for key, one in changes.items()
        }
    )
    yield _text(
        "Of the two systems that plan in words, GroundSG-QwenVL keeps most, and MemER less than",
        "pi0.5, which has no memory, in the first three settings. A low explicit rate is",
        "also easier to keep: near what chance gives, there is little to lose.",
    )


def _by_setting(cells: Mapping[tuple[str, str], str]) -> str:
    lines = [(model, *(cells[model, name] for name in IMPLICIT)) for model in models_of("main")]
    return _table(("model", *IMPLICIT), lines)


def _widths() -> Iterator[str]:
    widths = half_widths()
    usual = [width for rate, width in widths if 10 <= rate <= 90]  # noqa: PLR2004 - percent
    real, _ = TRIALS["real"]
    low, high = wilson_interval(real // 2, real)
    yield "## How wide is a cell?"
    yield _table(
        ("table", "trials of a cell", "half the 95 % interval (Wilson), points"),
        [
            ("main, planner, context", CELL, f"{min(usual):.0f} to {max(usual):.0f} (10 to 90 %)"),
            ("real world", real, f"{50 * (high - low):.0f} (50 %)"),
        ],
    )
    apart = 100 * Z_95 * math.sqrt(2 * 0.25 / CELL)
    yield _text(
        f"Two cells of {CELL} trials near 50 % differ by chance alone by up to {apart:.0f} points",
        "in 95 of 100 cases.",
    )


if __name__ == "__main__":
    PAGE.write_text(page(), encoding="utf-8")
