"""Figure: success of each policy in each implicit setting, next to explicit instructions."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from typing import TYPE_CHECKING, Any, NamedTuple

from roboirg.core.instruction_options import InstructionOptions
from roboirg.core.plain_text import counted
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
from roboirg.evaluation.analysis.stats.cells import Cells, PolicyRun
from roboirg.evaluation.analysis.stats.intervals import Interval
from roboirg.evaluation.analysis.stats.option_labels import (
    REFERENCE,
    has_default_options,
    setting_sort_key,
)
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
    """The fall from explicit to an implicit setting, on the same tasks and episodes, in percent.

    Attributes:
        explicit: mean success of the explicit setting; None if it was not played.
        implicit: that of the implicit setting.
        ends: of the 95 % interval of the difference, seen from `explicit`, or of `implicit` alone;
            None if unknown.
    """

    explicit: float | None
    implicit: float
    ends: Interval | None = None


class PolicyDrops(NamedTuple):
    """A policy with its drops by setting."""

    name: str
    is_own: bool
    drops: Mapping[str, Drop]


def draw_gaps(content: RunData, *, published: bool = False) -> Figure | None:
    """Draw a panel for each implicit setting and in it a line for each policy.

    In each panel, all policies are compared on the tasks that all of them played in the setting;
    the published ones alone on all of theirs. Without explicit, or with nothing else, the rates
    stand alone. None without results.
    """
    tasks = _shared_tasks(content.cells) if content.cells else _published_tasks()
    if len(tasks) > 1:
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
    drops = [drop for one in lines for drop in one.drops.values()]
    most = max(max(drop.implicit, drop.explicit or 0) for drop in drops)
    end = max(TICK, TICK * -(-int(most + 0.999) // TICK))
    panels[0].set_xlim(-0.04 * end, 1.04 * end)
    panels[0].set_xticks(range(0, end + 1, TICK))
    panels[0].set_ylim(len(lines) - 0.5, -0.5)
    names = [folded(one.name, NAME_LETTERS) for one in lines]
    panels[0].set_yticks(range(len(lines)), names)
    _add_legend(figure, drops)
    return figure


def _cells_of(cells: Cells, tasks: Mapping[str, Collection[str]]) -> Cells:
    """Return the cells of the given tasks of each setting, with default options."""
    return {
        key: cell
        for key, cell in cells.items()
        if key.task in tasks.get(key.options.setting, ()) and has_default_options(key.options)
    }


def _shared_tasks(cells: Cells) -> dict[str, list[str]]:
    """Return by setting the tasks that all policy runs with results in it played."""
    played: dict[str, dict[PolicyRun, list[str]]] = {}
    for key, cell in cells.items():
        if has_default_options(key.options) and cell.trials:
            runs = played.setdefault(key.options.setting, {})
            runs.setdefault(key.policy_run, []).append(key.task)
    shared = {}
    for setting in sorted(played, key=setting_sort_key):
        first, *others = played[setting].values()
        tasks = [task for task in first if all(task in other for other in others)]
        if tasks:
            shared[setting] = tasks
    return shared


def _published_tasks() -> dict[str, list[str]]:
    """Return by setting the tasks that have published rates."""
    rows = {row.options.setting: row for row in published_rows("main")}
    settings = sorted(rows, key=setting_sort_key)
    return {
        one: [task for task, rate in rows[one].rates.items() if rate is not None]
        for one in settings
    }


def _own(content: RunData, tasks: Mapping[str, Collection[str]]) -> list[PolicyDrops]:
    """Return a line for each policy run."""
    # Explicit cells stay whole: a drop is paired with those of its own tasks.
    known = {REFERENCE.setting: {key.task for key in content.cells}, **tasks}
    found = summaries_by_key(_cells_of(content.cells, known))
    lines = []
    for policy_run in content.names:
        drops = {}
        for setting in tasks:
            one = found.get(ScopeKey(policy_run, ALL, InstructionOptions(setting)))
            if one is None or one.rate is None:
                continue
            rate = 100 * float(one.rate)
            explicit = None if one.gap is None else rate - 100 * one.gap.value
            ends = one.interval if one.gap is None else one.gap.interval
            if ends is not None:
                ends = Interval(*(100 * end + (explicit or 0) for end in ends))
            drops[setting] = Drop(explicit, rate, ends)
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
                alone = setting == REFERENCE.setting
                drops[setting] = Drop(None if alone else float(explicit), float(implicit))
        lines.append(PolicyDrops(f"{reference.model} (published)", is_own=False, drops=drops))
    return lines


def _draw_panel(axes: Axes, lines: Sequence[PolicyDrops], setting: str) -> None:
    has_own = any(one.is_own for one in lines)
    for place, one in enumerate(lines):
        drop = one.drops.get(setting)
        if drop is None:
            continue
        color = first_color() if one.is_own or not has_own else GHOST
        if drop.ends is not None:
            axes.plot(drop.ends, [place, place], color=color, linewidth=4.5, alpha=0.3)
        if drop.explicit is not None:
            fall = [drop.explicit, drop.implicit]
            axes.plot(fall, [place, place], color=color, linewidth=1.3)
            axes.plot(fall[0], place, "o", color=color, markersize=4.8, markerfacecolor=paper())
            axes.text(
                1.02, place, points((fall[1] - fall[0]) / 100),
                transform=axes.get_yaxis_transform(), va="center", fontsize=7,
            )  # fmt: skip
        axes.plot(drop.implicit, place, "o", color=color, markersize=4.8)
    clear_axes(axes, grid="x")


def _add_legend(figure: Figure, drops: Sequence[Drop]) -> None:
    from matplotlib.lines import Line2D

    gray: dict[str, Any] = {"color": GHOST, "marker": "o", "linestyle": "none", "markersize": 4.8}
    handles, labels = [Line2D([], [], **gray)], ["success, %"]
    if any(drop.explicit is not None for drop in drops):
        handles.insert(0, Line2D([], [], **gray, markerfacecolor=paper()))
        labels = ["success with explicit instructions, %", "with implicit ones; number: difference"]
    if any(drop.ends for drop in drops):
        handles.append(Line2D([], [], color=GHOST, linewidth=4.5, alpha=0.3))
        of_gaps = any(drop.ends and drop.explicit is not None for drop in drops)
        labels.append("95 % interval of the difference" if of_gaps else "95 % interval")
    figure.legend(handles, labels, loc="outside lower center", ncols=3, columnspacing=1.5)
