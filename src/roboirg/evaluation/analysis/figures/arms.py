"""Figure: what control arms show, the two rates of each figure with their intervals."""

from __future__ import annotations

from typing import TYPE_CHECKING

from roboirg.evaluation.analysis.figures.figure_style import (
    COLORS,
    COLUMN_INCHES,
    SIGNS,
    TITLE_LETTERS,
    clear_axes,
    folded,
    new_figure,
    paper,
)
from roboirg.evaluation.analysis.stats.arm_figures import ArmFigure, arm_figures
from roboirg.evaluation.analysis.stats.option_labels import options_label
from roboirg.evaluation.analysis.stats.rates import points
from roboirg.evaluation.analysis.stats.run_data import RunData

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

ROW_INCHES, MARGIN_INCHES = 0.26, 0.7
TEXT_AT, ROOM = 106, 150
"""Positions of the difference and of the panel's end, in percent."""


def draw_arms(content: RunData) -> Figure | None:
    """Draw a panel for each policy; return None without control arms."""
    panels: dict[str, list[ArmFigure]] = {}
    names = content.told().names
    for one in arm_figures(content):
        panels.setdefault(names[one.policy_run], []).append(one)
    if not panels:
        return None
    heights = [len(rows) * ROW_INCHES + MARGIN_INCHES for rows in panels.values()]
    figure = new_figure(COLUMN_INCHES, sum(heights))
    axes = figure.subplots(len(panels), 1, squeeze=False, height_ratios=heights).ravel()
    for panel, (title, rows) in zip(axes, panels.items(), strict=True):
        _draw_panel(panel, rows)
        panel.set_title(folded(title, TITLE_LETTERS), loc="left")
    axes[-1].set_xlabel("%: first filled, second hollow", loc="left")
    return figure


def _draw_panel(axes: Axes, rows: list[ArmFigure]) -> None:
    labels = [
        f"{one.contrast.name}, {options_label(one.options)}\n"
        f"{one.contrast.first} / {one.contrast.second}"
        for one in rows
    ]
    for place, one in enumerate(rows):
        for side, (rate, interval) in enumerate(zip(one.rates, one.intervals, strict=True)):
            at, color = place + (0.15 if side else -0.15), COLORS[side]
            if interval is not None:
                axes.plot([100 * end for end in interval], [at, at], color=color, linewidth=1)
            filling = paper() if side else color
            axes.plot(
                100 * rate, at, SIGNS[side], color=color, markersize=3.5, markerfacecolor=filling
            )
        axes.text(TEXT_AT, place, points(one.gap.value), va="center", fontsize=6.5)
    clear_axes(axes, grid="x")
    axes.set_yticks(range(len(rows)), labels, fontsize=6)
    axes.set_ylim(len(rows) - 0.5, -0.5)
    axes.set_xlim(-3, ROOM)
    axes.set_xticks(range(0, 101, 25))
