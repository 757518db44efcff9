"""Figure: success by the stages of the contextual discourse that are spoken."""

from __future__ import annotations

import textwrap
from typing import TYPE_CHECKING

from roboirg.core.instruction_options import InstructionOptions
from roboirg.evaluation.analysis.figures.figure_style import (
    COLORS,
    GHOST,
    PUBLISHED_NOTE,
    draw_ghost,
    draw_point,
    legend_below,
    rates_figure,
)
from roboirg.evaluation.analysis.published import published_rows, published_tasks
from roboirg.evaluation.analysis.stats.cells import CellKey, Cells, PolicyRun
from roboirg.evaluation.analysis.stats.option_labels import staged_options
from roboirg.evaluation.analysis.stats.run_data import RunData, summaries_by_key
from roboirg.evaluation.analysis.stats.run_summary import ALL, ScopeKey

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

HEIGHT_INCHES = 2.4
SHIFT = 0.08
LABEL_LETTERS = 62
"""Letters of a line below the axes."""


def draw_context(content: RunData, *, published: bool = False) -> Figure | None:
    """Draw the means over the tasks played with every set of stages.

    Returns:
        None if no policy was played with several sets, or no task with all of them.
    """
    is_alone = published and not content.cells
    played = _played(content.cells)
    columns = [
        one for one in staged_options() if is_alone or any(one in own for own in played.values())
    ]
    cells, tasks = _shared(content.cells, list(played), columns)
    if is_alone:
        tasks = list(published_tasks("context"))
    if not tasks:
        return None
    ghosts = {
        (row.model, row.options): float(average)
        for row in (published_rows("context") if published else ())
        if (average := row.average_over(tasks)) is not None
    }
    models = list(dict.fromkeys(model for model, _ in ghosts))
    labels = [content.name(one) for one in {key.policy_run for key in cells}]
    labels += [f"{model} (published)" for model in models]
    figure, axes = rates_figure(HEIGHT_INCHES, labels)
    _draw_policies(axes, content, cells, columns)
    for number, model in enumerate(models):
        rates = [ghosts.get((model, options)) for options in columns]
        _draw_model(axes, f"{model} (published)", rates, number, in_color=is_alone)
    _set_axes(axes, columns, tasks, note=PUBLISHED_NOTE if ghosts else "")
    legend_below(figure, axes)
    return figure


def _draw_policies(
    axes: Axes, content: RunData, cells: Cells, columns: list[InstructionOptions]
) -> None:
    found = summaries_by_key(cells)
    policy_runs = [one for one in content.names if any(key.policy_run == one for key in found)]
    for number, policy_run in enumerate(policy_runs):
        shift = SHIFT * (number - (len(policy_runs) - 1) / 2)
        line = []
        for place, options in enumerate(columns):
            one = found.get(ScopeKey(policy_run, ALL, options))
            if one is not None and one.rate is not None:
                rate, label = float(one.rate), content.name(policy_run)
                line.append((place + shift, 100 * rate))
                draw_point(axes, place + shift, rate, one.interval, number, label)
        axes.plot(*zip(*line, strict=True), color=COLORS[number % len(COLORS)], linewidth=0.8)


def _draw_model(
    axes: Axes, label: str, rates: list[float | None], number: int, *, in_color: bool
) -> None:
    line = [(place, rate) for place, rate in enumerate(rates) if rate is not None]
    for place, rate in line:
        if in_color:
            draw_point(axes, place, rate / 100, None, number, label)
        else:
            draw_ghost(axes, place, rate, number, label)
    color = COLORS[number % len(COLORS)] if in_color else GHOST
    axes.plot(*zip(*line, strict=True), color=color, linewidth=0.6, linestyle=":", zorder=1)


def _set_axes(
    axes: Axes, columns: list[InstructionOptions], tasks: list[str], *, note: str
) -> None:
    axes.set_xticks(range(len(columns)), [",".join(map(str, one.stages)) for one in columns])
    axes.set_xlim(-0.4, len(columns) - 0.6)
    words = textwrap.fill(f"stages that are spoken; mean over {', '.join(tasks)}", LABEL_LETTERS)
    axes.set_xlabel(f"{words}\n{note}".rstrip(), fontsize=6)


def _played(cells: Cells) -> dict[PolicyRun, set[InstructionOptions]]:
    """Return the sets of stages that each policy run played, for those that played several."""
    staged = staged_options()
    found: dict[PolicyRun, set[InstructionOptions]] = {}
    for key, cell in cells.items():
        if key.options in staged and cell.trials:
            found.setdefault(key.policy_run, set()).add(key.options)
    return {policy_run: own for policy_run, own in found.items() if len(own) > 1}


def _shared(
    cells: Cells, policy_runs: list[PolicyRun], columns: list[InstructionOptions]
) -> tuple[Cells, list[str]]:
    """Return the tasks that all policy runs played with every set of stages, and their cells."""
    kept = {
        key: cell
        for key, cell in cells.items()
        if key.policy_run in policy_runs and key.options in columns and cell.trials
    }
    tasks = [
        task
        for task in dict.fromkeys(key.task for key in kept)
        if all(CellKey(one, task, options) in kept for one in policy_runs for options in columns)
    ]
    return {key: cell for key, cell in kept.items() if key.task in tasks}, tasks
