"""Figure: average over tasks in each setting, for each policy."""

from __future__ import annotations

from typing import TYPE_CHECKING

from roboirg.analysis.figures.figure_data import FigureData
from roboirg.analysis.figures.figure_style import (
    GHOST,
    draw_ghost,
    draw_point,
    legend_below,
    rates_figure,
)
from roboirg.analysis.published import published_rows
from roboirg.analysis.stats.option_labels import default_settings
from roboirg.analysis.stats.run_summary import ALL, ScopeKey
from roboirg.core.instruction_options import InstructionOptions
from roboirg.util.plurals import counted

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

HEIGHT_INCHES = 2.5
SPREAD = 0.62
"""Width of the points of one setting, relative to the distance between settings."""
GHOST_PLACE = 0.42


def draw_averages(content: FigureData, *, published: bool = False) -> Figure | None:
    """Draw the unweighted means over tasks with their intervals; return None without any."""
    settings = default_settings(key.options for key in content.summaries)
    if not settings:
        return None
    ghosts = published_rows("main") if published else ()
    models = list(dict.fromkeys(row.model for row in ghosts))
    figure, axes = rates_figure(HEIGHT_INCHES, len(content.names) + len(models))
    for number, policy_run in enumerate(content.names):
        label = content.name(policy_run)
        for place, setting in enumerate(settings):
            key = ScopeKey(policy_run, ALL, InstructionOptions(setting))
            one = content.summaries.get(key)
            if one is not None and one.rate is not None:
                at = place + _offset(number, len(content.names))
                draw_point(axes, at, float(one.rate), one.interval, number, label)
    for row in ghosts:
        if row.options.setting in settings:
            at = settings.index(row.options.setting) + GHOST_PLACE
            number = models.index(row.model)
            draw_ghost(axes, at, float(row.average), number, f"{row.model} (published)")
    _set_axes(axes, content, settings, room=GHOST_PLACE if ghosts else 0.0)
    legend_below(figure, axes)
    return figure


def _set_axes(axes: Axes, content: FigureData, settings: list[str], room: float) -> None:
    axes.set_xticks(range(len(settings)), [_label(content, setting) for setting in settings])
    axes.set_xlim(-0.5, len(settings) - 0.5 + (0.1 if room else 0))
    for edge in range(1, len(settings)):
        axes.axvline(edge - 0.5 + (0.05 if room else 0), color=GHOST, linewidth=0.3, alpha=0.5)


def _label(content: FigureData, setting: str) -> str:
    """Return the setting and the number of tasks in its mean."""
    counts = [
        len(one.tasks)
        for key, one in content.summaries.items()
        if key.scope == ALL and key.options == InstructionOptions(setting) and one.rate is not None
    ]
    low, high = min(counts, default=0), max(counts, default=0)
    return f"{setting}\n({'' if low == high else f'{low}–'}{counted(high, 'task')})"


def _offset(number: int, count: int) -> float:
    return SPREAD * ((number + 0.5) / count - 0.5)
