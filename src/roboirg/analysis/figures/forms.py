"""Figure: each suite in implicit and in resolved form, with what both solve and what one alone."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

from roboirg.analysis.figures.figure_data import FigureData
from roboirg.analysis.figures.figure_style import COLUMN_INCHES, PAGE_INCHES, clear_axes, new_figure
from roboirg.analysis.stats.paired_tests import Gap
from roboirg.analysis.stats.run_summary import ALL, Scope
from roboirg.analysis.stats.samples import PolicyRun
from roboirg.analysis.stats.success_rates import SETTING_ORDER, SettingColumn
from roboirg.analysis.tables.run_tables import ALL_TASKS, points

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure
    from matplotlib.patches import Patch

ROW_INCHES, MARGIN_INCHES = 0.175, 0.85
PARTS = (
    ("solved in both forms", "#56B4E9", ""),
    ("only resolved", "#D55E00", "////"),
    ("only implicit", "#009E73", "...."),
    ("neither", "#dddddd", ""),
)
"""What an episode did in the two forms: words, color, pattern."""
WORDS_AT, ROOM = 103, 160
"""Where the difference is written and where the panel ends, in percent of the episodes."""
MOST_PANELS = 2
"""Side by side."""


class FormRow(NamedTuple):
    """A bar: where, and what came of the two forms there."""

    scope: str
    setting: str
    gap: Gap


def draw_forms(content: FigureData) -> Figure | None:
    """Draw the overlap of the two forms and their difference; None if not both were played."""
    panels = {who: rows for who in content.names if (rows := _rows(content, who))}
    if not panels:
        return None
    across = min(MOST_PANELS, len(panels))
    down = -(-len(panels) // across)
    height = max(len(rows) + len({row.scope for row in rows}) for rows in panels.values()) + 1
    figure = new_figure(
        PAGE_INCHES if across > 1 else COLUMN_INCHES,
        down * (ROW_INCHES * height) + MARGIN_INCHES,
    )
    axes = figure.subplots(down, across, squeeze=False).ravel()
    for panel, (who, rows) in zip(axes, panels.items(), strict=False):
        _draw_panel(panel, rows)
        panel.set_title(content.name(who), fontsize=8.5, loc="left", fontweight="bold")
    for panel in axes[len(panels) :]:
        panel.set_visible(False)
    handles = _handles()
    figure.legend(
        handles, [words for words, _, _ in PARTS], loc="outside lower center",
        ncols=len(PARTS) if across > 1 else 2, columnspacing=1.2, handletextpad=0.4,
    )  # fmt: skip
    return figure


def _rows(content: FigureData, who: PolicyRun) -> list[FormRow]:
    suites = dict.fromkeys(
        scope.suite for _, scope, _ in content.summaries if scope.suite is not None
    )
    scopes = [(str(suite), Scope(suite=suite)) for suite in suites]
    if len(scopes) > 1:
        scopes.append((ALL_TASKS, ALL))
    return [
        FormRow(name, setting, one.form_gap)
        for name, scope in scopes
        for setting in SETTING_ORDER
        if (one := content.summaries.get((who, scope, SettingColumn(setting)))) is not None
        if one.form_gap is not None
    ]


def _draw_panel(axes: Axes, rows: list[FormRow]) -> None:
    places: list[float] = []
    for number, row in enumerate(rows):
        begins = number == 0 or row.scope != rows[number - 1].scope
        places.append((places[-1] + 1 if places else -1.0) + (1.0 if begins else 0.0))
        if begins:
            axes.text(0, places[-1] - 0.72, row.scope, fontsize=7, va="center", fontweight="bold")
    for place, row in zip(places, rows, strict=True):
        _draw_bar(axes, place, row.gap)
    axes.set_yticks(places, [row.setting for row in rows])
    axes.set_ylim(places[-1] + 0.7, -1.1)
    axes.set_xlim(0, ROOM)
    axes.set_xticks(range(0, 101, 25))
    axes.set_xlabel("share of the episodes, %", x=50 / ROOM, fontsize=7.5)
    clear_axes(axes, grid="x")
    axes.spines["bottom"].set_bounds(0, 100)
    axes.text(WORDS_AT, -0.72, "implicit − resolved", fontsize=6.5, va="center", color="#555555")


def _draw_bar(axes: Axes, place: float, gap: Gap) -> None:
    overlap = gap.overlap
    left = 0.0
    counts = (overlap.both, overlap.only_second, overlap.only_first, overlap.neither)
    for (_, color, pattern), count in zip(PARTS, counts, strict=True):
        width = 100 * count / overlap.trials if overlap.trials else 0.0
        axes.barh(
            place, width, left=left, height=0.78, color=color, hatch=pattern, edgecolor="white",
            linewidth=0.4,
        )  # fmt: skip
        left += width
    words = points(gap.value)
    if gap.interval is not None:
        words += f" [{points(gap.interval.low)}, {points(gap.interval.high)}]"
    axes.text(WORDS_AT, place, words, va="center", fontsize=6.5)


def _handles() -> list[Patch]:
    from matplotlib.patches import Patch

    return [Patch(facecolor=color, hatch=pattern, edgecolor="white") for _, color, pattern in PARTS]
