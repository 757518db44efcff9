"""Figure: overlap of the implicit and the resolved form, by suite and setting."""

from __future__ import annotations

from typing import TYPE_CHECKING

from roboirg.evaluation.analysis.figures.figure_style import (
    COLUMN_INCHES,
    PAGE_INCHES,
    TITLE_LETTERS,
    clear_axes,
    folded,
    new_figure,
    paper,
)
from roboirg.evaluation.analysis.stats.form_gaps import FormRow, form_rows
from roboirg.evaluation.analysis.stats.paired_tests import Gap
from roboirg.evaluation.analysis.stats.rates import points
from roboirg.evaluation.analysis.stats.run_data import RunData

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
"""Outcomes of an episode in the two forms: label, color, pattern."""
TEXT_AT, ROOM = 103, 160
"""Positions of the difference and of the panel's end, in percent of the episodes."""
MAX_COLUMNS = 2
"""Panels side by side."""


def draw_forms(content: RunData) -> Figure | None:
    """Draw overlap and difference of the two forms; return None unless both were played."""
    panels = {one: rows for one in content.names if (rows := form_rows(content, one))}
    if not panels:
        return None
    across = min(MAX_COLUMNS, len(panels))
    down = -(-len(panels) // across)
    height = max(len(rows) + len({row.scope for row in rows}) for rows in panels.values()) + 1
    figure = new_figure(
        PAGE_INCHES if across > 1 else COLUMN_INCHES,
        down * (ROW_INCHES * height) + MARGIN_INCHES,
    )
    axes = figure.subplots(down, across, squeeze=False).ravel()
    for panel, (policy_run, rows) in zip(axes, panels.items(), strict=False):
        _draw_panel(panel, rows)
        title = folded(content.name(policy_run), TITLE_LETTERS)
        panel.set_title(title, loc="left")
    for panel in axes[len(panels) :]:
        panel.set_visible(False)
    handles = _handles()
    figure.legend(
        handles, [label for label, _, _ in PARTS], loc="outside lower center",
        ncols=len(PARTS) if across > 1 else 2, columnspacing=1.2, handletextpad=0.4,
    )  # fmt: skip
    return figure


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
    axes.text(TEXT_AT, -0.72, "implicit − resolved", fontsize=6.5, va="center")


def _draw_bar(axes: Axes, place: float, gap: Gap) -> None:
    overlap = gap.overlap
    left = 0.0
    counts = (overlap.both, overlap.only_second, overlap.only_first, overlap.neither)
    for (_, color, pattern), count in zip(PARTS, counts, strict=True):
        width = 100 * count / overlap.trials if overlap.trials else 0.0
        axes.barh(
            place, width, left=left, height=0.78, color=color, hatch=pattern, edgecolor=paper(),
            linewidth=0.4,
        )  # fmt: skip
        left += width
    text = points(gap.value)
    if gap.interval is not None:
        text += f" [{points(gap.interval.low)}, {points(gap.interval.high)}]"
    axes.text(TEXT_AT, place, text, va="center", fontsize=6.5)


def _handles() -> list[Patch]:
    from matplotlib.patches import Patch

    return [Patch(facecolor=color, hatch=pattern, edgecolor=paper()) for _, color, pattern in PARTS]
