"""Draw success rates by setting, of a study beside the paper's."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

from roboirg.apps.real.pages.trial_sheet import check_sheet_support
from roboirg.core.errors import InvalidValueError
from roboirg.evaluation.analysis.published import TRIALS
from roboirg.evaluation.analysis.stats.cells import Cells
from roboirg.evaluation.analysis.stats.intervals import wilson_interval
from roboirg.evaluation.analysis.stats.option_labels import setting_sort_key
from roboirg.evaluation.analysis.tables.paper_tables import make_table
from roboirg.evaluation.analysis.tables.table import Row, Table
from roboirg.evaluation.records.store import StoreError

if TYPE_CHECKING:
    from matplotlib.axes import Axes

FORMATS = ("png", "svg")
NAME = "real"
COLORS = ("#0072B2", "#D55E00", "#009E73", "#CC79A7", "#E69F00", "#56B4E9")
"""Palette of Okabe and Ito, safe for color-blind readers."""
PUBLISHED_COLORS = ("#777777", "#aaaaaa")
HATCH = "//"
PANEL_INCHES = (5.2, 3.4)
DOTS_PER_INCH = 200


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


def write_figure(samples: Cells, folder: Path, *, published: bool = True) -> tuple[Path, ...]:
    """Draw success by setting, a panel for each task, as PNG and SVG.

    Args:
        samples: of the studies.
        folder: created if it is missing.
        published: whether to draw the paper's values beside them.

    Returns:
        The paths of the files.

    Raises:
        InvalidValueError: no trial has a verdict.
        MissingDependencyError: matplotlib is not installed.
        StoreError: the files cannot be written.
    """
    check_sheet_support()
    import matplotlib as mpl
    from matplotlib.figure import Figure

    table = make_table("real", samples, published=published)
    series = bar_series(table)
    if not any(one.bars for one in series):
        raise InvalidValueError("The runs have no trial of a real-robot task with a verdict.")
    tasks = [column.name for column in table.columns if not column.averages]
    figure = Figure(figsize=(PANEL_INCHES[0] * len(tasks), PANEL_INCHES[1]), layout="constrained")
    for number, task in enumerate(tasks, 1):
        _draw(figure.add_subplot(1, len(tasks), number), task, series)
    handles, labels = figure.axes[0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside lower center", ncols=min(len(labels), 4))
    paths = tuple(folder / f"{NAME}.{kind}" for kind in FORMATS)
    try:
        folder.mkdir(parents=True, exist_ok=True)
        with mpl.rc_context({"svg.hashsalt": NAME}):
            for path in paths:
                # Without the date, so that the same records give the same file.
                metadata = {"Date": None} if path.suffix == ".svg" else {}
                figure.savefig(path, dpi=DOTS_PER_INCH, metadata=metadata)
    except OSError as error:
        raise StoreError(f"Cannot write to {folder}: {error.strerror}.") from error
    return paths


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
            edgecolor="white",
            label=f"{one.name} (published)" if one.published else one.name,
            yerr=[[max(bar.percent - bar.low, 0.0) for bar in bars],
                  [max(bar.high - bar.percent, 0.0) for bar in bars]],
            error_kw={"elinewidth": 0.8, "capsize": 2.0},
        )  # fmt: skip
    axes.set_xticks(range(len(settings)), settings)
    axes.set_ylim(0, 105)
    axes.set_title(task)
    axes.set_ylabel("success, %")
    axes.spines[["top", "right"]].set_visible(False)
