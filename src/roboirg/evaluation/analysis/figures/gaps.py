"""Figure: what each implicit setting costs each policy, next to explicit instructions."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from typing import TYPE_CHECKING, Any, NamedTuple

from roboirg.core.instruction_options import InstructionOptions
from roboirg.core.plain_text import counted
from roboirg.evaluation.analysis.figures.averages import cells_of, published_tasks, shared_tasks
from roboirg.evaluation.analysis.figures.figure_style import (
    GHOST,
    LEGEND_LINE_INCHES,
    PAGE_INCHES,
    clear_axes,
    first_color,
    folded,
    new_figure,
    paper,
)
from roboirg.evaluation.analysis.published import published_rows
from roboirg.evaluation.analysis.stats.intervals import Interval
from roboirg.evaluation.analysis.stats.option_labels import REFERENCE
from roboirg.evaluation.analysis.stats.rates import points
from roboirg.evaluation.analysis.stats.run_data import RunData, summaries_by_key
from roboirg.evaluation.analysis.stats.run_summary import ALL, ScopeKey

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

MOST_COLUMNS = 4
ROW_INCHES, MARGIN_INCHES = 0.25, 0.6
NAME_LETTERS = 26
TASKS_STYLE: Mapping[str, Any] = {"fontsize": 6.5, "fontweight": "normal", "color": GHOST}
TICK = 25
"""The scale ends at a multiple of this, percent."""


class Drop(NamedTuple):
    """The fall from explicit to an implicit setting, on the same tasks and episodes.

    Attributes:
        explicit: mean success of the explicit setting, percent.
        implicit: that of the implicit setting.
        interval: 95 % interval of the difference, percentage points; None if unknown.
    """

    explicit: float
    implicit: float
    interval: Interval | None = None


class PolicyDrops(NamedTuple):
    """A policy with its drops by setting."""

    name: str
    is_own: bool
    drops: Mapping[str, Drop]


def draw_gaps(content: RunData, *, published: bool = False) -> Figure | None:
    """Draw a panel for each implicit setting and in it a line for each policy.

    In each panel, all policies are compared on the tasks that all of them played in the setting;
    the published ones alone on all of theirs. None without an implicit setting next to explicit.
    """
    tasks = shared_tasks(content.cells) if content.cells else published_tasks()
    tasks.pop(REFERENCE.setting, None)
    lines = _own(content, tasks) + (_published(tasks) if published else [])
    lines = [one for one in lines if one.drops]
    settings = [name for name in tasks if any(name in one.drops for one in lines)]
    if not settings:
        return None
    columns = min(MOST_COLUMNS, len(settings))
    down = -(-len(settings) // columns)
    height = down * (ROW_INCHES * len(lines) + MARGIN_INCHES) + LEGEND_LINE_INCHES
    figure = new_figure(PAGE_INCHES, height)
    panels = figure.subplots(down, columns, sharex=True, sharey=True, squeeze=False).ravel()
    for panel, setting in zip(panels, settings, strict=False):
        _draw_panel(panel, lines, setting)
        panel.set_title(setting, loc="left")
        panel.set_title(counted(len(tasks[setting]), "task"), loc="right", **TASKS_STYLE)
    for panel in panels[len(settings) :]:
        panel.set_visible(False)
    most = max(max(drop[:2]) for one in lines for drop in one.drops.values())
    end = max(TICK, TICK * -(-int(most + 0.999) // TICK))
    panels[0].set_xlim(-0.04 * end, 1.04 * end)
    panels[0].set_xticks(range(0, end + 1, TICK))
    panels[0].set_ylim(len(lines) - 0.5, -0.5)
    names = [folded(one.name, NAME_LETTERS) for one in lines]
    panels[0].set_yticks(range(len(lines)), names)
    _add_legend(figure, any(d.interval for one in lines for d in one.drops.values()))
    return figure


def _own(content: RunData, tasks: Mapping[str, Collection[str]]) -> list[PolicyDrops]:
    """Return a line for each policy run."""
    # Explicit cells stay whole: a drop is paired with those of its own tasks.
    known = {**tasks, REFERENCE.setting: {key.task for key in content.cells}}
    found = summaries_by_key(cells_of(content.cells, known))
    lines = []
    for policy_run in content.names:
        drops = {}
        for setting in tasks:
            one = found.get(ScopeKey(policy_run, ALL, InstructionOptions(setting)))
            if one is not None and one.rate is not None and one.gap is not None:
                rate, gap = 100 * float(one.rate), one.gap
                drops[setting] = Drop(rate - 100 * gap.value, rate, gap.interval)
        lines.append(PolicyDrops(content.name(policy_run), is_own=True, drops=drops))
    return lines


def _published(tasks: Mapping[str, Collection[str]]) -> list[PolicyDrops]:
    """Return a line for each published policy, the best explicit one first."""
    rows = {(row.model, row.options.setting): row for row in published_rows("main")}
    references = [row for row in published_rows("main") if row.options == REFERENCE]
    lines = []
    for reference in sorted(references, key=lambda row: -row.average):
        drops = {}
        for setting, names in tasks.items():
            row = rows.get((reference.model, setting))
            explicit = reference.average_over(names)
            implicit = None if row is None else row.average_over(names)
            if explicit is not None and implicit is not None:
                drops[setting] = Drop(float(explicit), float(implicit))
        lines.append(PolicyDrops(f"{reference.model} (published)", is_own=False, drops=drops))
    return lines


def _draw_panel(axes: Axes, lines: Sequence[PolicyDrops], setting: str) -> None:
    has_own = any(one.is_own for one in lines)
    for place, one in enumerate(lines):
        drop = one.drops.get(setting)
        if drop is None:
            continue
        color = first_color() if one.is_own or not has_own else GHOST
        if drop.interval is not None:
            ends = [drop.explicit + 100 * end for end in drop.interval]
            axes.plot(ends, [place, place], color=color, linewidth=4.5, alpha=0.3)
        axes.plot(drop[:2], [place, place], color=color, linewidth=1.3)
        axes.plot(drop.explicit, place, "o", color=color, markersize=4.8, markerfacecolor=paper())
        axes.plot(drop.implicit, place, "o", color=color, markersize=4.8)
        axes.text(
            1.02, place, points((drop.implicit - drop.explicit) / 100),
            transform=axes.get_yaxis_transform(), va="center", fontsize=7,
        )  # fmt: skip
    clear_axes(axes, grid="x")


def _add_legend(figure: Figure, has_intervals: bool) -> None:
    from matplotlib.lines import Line2D

    gray: dict[str, Any] = {"color": GHOST, "marker": "o", "linestyle": "none", "markersize": 4.8}
    handles = [Line2D([], [], **gray, markerfacecolor=paper()), Line2D([], [], **gray)]
    labels = ["success with explicit instructions, %", "with implicit ones; number: difference"]
    if has_intervals:
        handles.append(Line2D([], [], color=GHOST, linewidth=4.5, alpha=0.3))
        labels.append("95 % interval of the difference")
    figure.legend(handles, labels, loc="outside lower center", ncols=3, columnspacing=1.5)
