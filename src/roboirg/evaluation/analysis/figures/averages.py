"""Figure: average over tasks in each setting, for each policy."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from typing import TYPE_CHECKING

from roboirg.core.instruction_options import InstructionOptions
from roboirg.core.plain_text import counted
from roboirg.evaluation.analysis.figures.figure_style import (
    GHOST,
    PUBLISHED_NOTE,
    draw_ghost,
    draw_point,
    legend_below,
    rates_figure,
)
from roboirg.evaluation.analysis.published import published_rows
from roboirg.evaluation.analysis.stats.cells import Cells, PolicyRun
from roboirg.evaluation.analysis.stats.option_labels import has_default_options, setting_sort_key
from roboirg.evaluation.analysis.stats.run_data import RunData, summaries_by_key
from roboirg.evaluation.analysis.stats.run_summary import ALL, ScopeKey

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

HEIGHT_INCHES = 2.5
SPREAD = 0.62
"""Width of the points of one setting, relative to the distance between settings."""
GHOST_PLACE = 0.42


def draw_averages(content: RunData, *, published: bool = False) -> Figure | None:
    """Draw the unweighted means over tasks with their intervals; return None without any.

    In each setting all means, the published ones too, are over the tasks that every policy with
    results in the setting played; without results the published ones are over all of theirs.
    """
    is_alone = published and not content.cells
    shared = published_tasks() if is_alone else shared_tasks(content.cells)
    if not shared:
        return None
    found = summaries_by_key(cells_of(content.cells, shared))
    ghosts = _ghosts(shared) if published else []
    models = list(dict.fromkeys(model for model, _, _ in ghosts))
    settings = list(shared)
    labels = [content.name(one) for one in content.names]
    labels += [f"{model} (published)" for model in models]
    figure, axes = rates_figure(HEIGHT_INCHES, labels)
    for number, policy_run in enumerate(content.names):
        label = content.name(policy_run)
        for place, setting in enumerate(settings):
            one = found.get(ScopeKey(policy_run, ALL, InstructionOptions(setting)))
            if one is not None and one.rate is not None:
                at = place + _offset(number, len(content.names))
                draw_point(axes, at, float(one.rate), one.interval, number, label)
    for model, setting, average in ghosts:
        number, label = models.index(model), f"{model} (published)"
        if is_alone:
            at = settings.index(setting) + _offset(number, len(models))
            draw_point(axes, at, average / 100, None, number, label)
        else:
            draw_ghost(axes, settings.index(setting) + GHOST_PLACE, average, number, label)
    _set_axes(axes, shared, room=GHOST_PLACE if ghosts and not is_alone else 0.0)
    legend_below(figure, axes)
    return figure


def cells_of(cells: Cells, tasks: Mapping[str, Collection[str]]) -> Cells:
    """Return the cells of the given tasks of each setting, with default options."""
    return {
        key: cell
        for key, cell in cells.items()
        if key.task in tasks.get(key.options.setting, ()) and has_default_options(key.options)
    }


def shared_tasks(cells: Cells) -> dict[str, list[str]]:
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


def published_tasks() -> dict[str, list[str]]:
    """Return by setting the tasks that have published rates."""
    rows = {row.options.setting: row for row in published_rows("main")}
    settings = sorted(rows, key=setting_sort_key)
    return {
        one: [task for task, rate in rows[one].rates.items() if rate is not None]
        for one in settings
    }


def _ghosts(shared: Mapping[str, Collection[str]]) -> list[tuple[str, str, float]]:
    """Return model, setting and mean of each published row over the shared tasks."""
    return [
        (row.model, row.options.setting, float(average))
        for row in published_rows("main")
        if (average := row.average_over(shared.get(row.options.setting, ()))) is not None
    ]


def _set_axes(axes: Axes, shared: Mapping[str, Collection[str]], room: float) -> None:
    labels = [f"{setting}\n({counted(len(tasks), 'task')})" for setting, tasks in shared.items()]
    axes.set_xticks(range(len(labels)), labels)
    axes.set_xlim(-0.5, len(labels) - 0.5 + (0.1 if room else 0))
    for edge in range(1, len(labels)):
        axes.axvline(edge - 0.5 + (0.05 if room else 0), color=GHOST, linewidth=0.3, alpha=0.5)
    if room:
        axes.set_xlabel(PUBLISHED_NOTE, fontsize=6, color=GHOST)


def _offset(number: int, count: int) -> float:
    return SPREAD * ((number + 0.5) / count - 0.5)
