"""Success by setting of studies with a real robot or its twin, next to the paper's."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, NamedTuple

from roboirg.evaluation.analysis.figures.figure_style import (
    COLORS,
    PAGE_INCHES,
    clear_axes,
    legend_below,
    new_figure,
    paper,
)
from roboirg.evaluation.analysis.published import TRIALS
from roboirg.evaluation.analysis.stats.intervals import wilson_interval
from roboirg.evaluation.analysis.stats.option_labels import setting_sort_key
from roboirg.evaluation.analysis.stats.run_data import RunData
from roboirg.evaluation.analysis.tables.paper_tables import make_table
from roboirg.evaluation.analysis.tables.table import Row, Table

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

PUBLISHED_COLORS = ("#777777", "#aaaaaa")
HATCH = "//"
PANEL_HEIGHT = 2.6
"""In inches."""


class Bar(NamedTuple):
    """One bar.

    Attributes:
        percent: success rate.
        low: lower end of its 95 % interval, percent.
        high: upper end.
    """

    percent: float
    low: float
    high: float


class Series(NamedTuple):
    """The bars of one policy.

    Attributes:
        name: of the policy.
        published: whether the values are the paper's.
        bars: by task and setting; cells without a value have none.
    """

    name: str
    published: bool
    bars: dict[tuple[str, str], Bar]


def bar_series(table: Table) -> tuple[Series, ...]:
    """Return a series of bars for each policy of the real-world table, in its order.

    Intervals are Wilson's: our own from the table, the paper's from its ten trials.
    """
    found: dict[tuple[str, bool], Series] = {}
    for row in table.rows:
        if row.source not in ("ours", "published"):
            continue
        published = row.source == "published"
        series = found.setdefault((row.name, published), Series(row.name, published, {}))
        for task, bar in _bars(table, row, published=published):
            series.bars[task, row.group] = bar
    return tuple(sorted(found.values(), key=lambda one: one.published))


def draw_real_robot(content: RunData, *, published: bool) -> Figure | None:
    """Draw success of real-robot tasks by setting, a panel for each task; None without verdicts.

    Without results the published ones are drawn.
    """
    table = make_table("real", content.cells, published=published)
    series = bar_series(table)
    is_alone = published and not content.cells
    if not any(one.bars for one in series if is_alone or not one.published):
        return None
    tasks = [column.name for column in table.columns if not column.averages]
    figure = new_figure(PAGE_INCHES, PANEL_HEIGHT)
    for number, task in enumerate(tasks, 1):
        _draw(figure.add_subplot(1, len(tasks), number), task, series)
    legend_below(figure, figure.axes[0])
    return figure


def _bars(table: Table, row: Row, *, published: bool) -> list[tuple[str, Bar]]:
    bars = []
    for column, entry in zip(table.columns, row.entries, strict=True):
        if column.averages or entry.percent is None:
            continue
        rate = float(entry.percent)
        if entry.counts is not None:
            interval = entry.counts.interval
        elif published:
            trials = TRIALS["real"][0]
            interval = wilson_interval(round(rate * trials / 100), trials)
        else:
            interval = None
        low, high = (rate, rate) if interval is None else (100 * interval.low, 100 * interval.high)
        bars.append((column.name, Bar(rate, low, high)))
    return bars


def _draw(axes: Axes, task: str, series: Sequence[Series]) -> None:
    found = {setting for each in series for name, setting in each.bars if name == task}
    settings = sorted(found, key=setting_sort_key)
    width = 0.8 / len(series)
    colors = {True: iter(PUBLISHED_COLORS * len(series)), False: iter(COLORS * len(series))}
    for number, one in enumerate(series):
        shown = [index for index, setting in enumerate(settings) if (task, setting) in one.bars]
        bars = [one.bars[task, settings[index]] for index in shown]
        positions = [index - 0.4 + (number + 0.5) * width for index in shown]
        axes.bar(
            positions,
            [bar.percent for bar in bars],
            width,
            color=next(colors[one.published]),
            hatch=HATCH if one.published else None,
            edgecolor=paper(),
            label=f"{one.name} (published)" if one.published else one.name,
            yerr=[[max(bar.percent - bar.low, 0.0) for bar in bars],
                  [max(bar.high - bar.percent, 0.0) for bar in bars]],
            error_kw={"elinewidth": 0.8, "capsize": 2.0},
        )  # fmt: skip
    axes.set_xticks(range(len(settings)), settings)
    clear_axes(axes, grid="y")
    axes.set_ylim(0, 105)
    axes.set_title(task)
    axes.set_ylabel("success, %")
