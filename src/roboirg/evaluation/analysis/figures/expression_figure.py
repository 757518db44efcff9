"""Figure of the referring expressions in each setting."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from roboirg.evaluation.analysis.figures.expression_counts import (
    expression_counts,
    expression_order,
    scene_counts,
)
from roboirg.language.instruction import Instruction
from roboirg.language.settings import all_settings
from roboirg.util.figure_files import save_figure

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

FORMATS = ("png", "svg")
PANEL_INCHES, SIDE_INCHES = 2.6, 0.9
ROW_INCHES, MARGIN_INCHES = 0.29, 1.25
DOTS_PER_INCH = 200
PANEL_RANGE = 1.25
"""Width of a panel in units of the longest bar; leaves space for its number."""


def write_figure(
    instructions: Sequence[Instruction], folder: Path, name: str, title: str
) -> tuple[Path, ...]:
    """Draw the number of scenes with each class of referring expression, as PNG and SVG.

    Args:
        instructions: the instructions to count in.
        folder: created if it is missing.
        name: of the files, without extension.
        title: above the panels.

    Returns:
        The files.

    Raises:
        MissingDependencyError: matplotlib is not installed.
        InvalidValueError: the folder is not writable.
    """
    return save_figure(
        lambda: _draw(instructions, title),
        folder,
        name,
        formats=FORMATS,
        dots_per_inch=DOTS_PER_INCH,
        style={"font.size": 9},
    )


def _draw(instructions: Sequence[Instruction], title: str) -> Figure:
    # Without pyplot, which keeps every figure and looks for a display.
    from matplotlib.figure import Figure
    from matplotlib.layout_engine import ConstrainedLayoutEngine
    from matplotlib.ticker import MaxNLocator

    counts, scenes = expression_counts(instructions), scene_counts(instructions)
    settings = [setting for setting in all_settings() if setting in counts]
    classes = expression_order(counts)
    size = (
        PANEL_INCHES * max(1, len(settings)) + SIDE_INCHES,
        ROW_INCHES * len(classes) + MARGIN_INCHES,
    )
    figure = Figure(figsize=size, layout=ConstrainedLayoutEngine(w_pad=0.08, h_pad=0.08))
    figure.suptitle(title, x=0.01, ha="left", fontsize=11, fontweight="bold")
    if settings:
        # One scale, to compare bars across panels.
        panels = figure.subplots(1, len(settings), sharex=True, sharey=True, squeeze=False)[0]
        for panel, setting in zip(panels, settings, strict=True):
            numbers = [counts[setting].get(one, 0) for one in classes]
            _draw_panel(panel, classes, numbers, all_settings()[setting].color)
            panel.set_title(f"{setting} ({scenes[setting]} scenes)", fontsize=10)
        most = max(number for one in counts.values() for number in one.values())
        panels[0].set_xlim(0, PANEL_RANGE * most)
        panels[0].xaxis.set_major_locator(MaxNLocator(nbins=5, integer=True))  # shared by all
        panels[0].invert_yaxis()
        figure.supxlabel("scenes in which the expression occurs", fontsize=9)
    return figure


def _draw_panel(panel: Axes, classes: Iterable[str], numbers: list[int], color: str) -> None:
    positions = range(len(numbers))
    bars = panel.barh(positions, numbers, color=color, height=0.72)
    panel.bar_label(bars, [str(one) if one else "" for one in numbers], padding=3, fontsize=8)
    panel.set_yticks(positions, list(classes))
    panel.set_axisbelow(True)
    panel.grid(axis="x", color="#dddddd", linewidth=0.6)
    panel.tick_params(axis="both", length=0)
    for side in ("top", "right", "left"):
        panel.spines[side].set_visible(False)
    panel.spines["bottom"].set_color("#999999")
