"""Figure: success by how much of the contextual discourse is spoken."""

from __future__ import annotations

from typing import TYPE_CHECKING

from roboirg.analysis.figures.figure_data import FigureData, by_key
from roboirg.analysis.figures.figure_style import (
    COLORS,
    GHOST,
    draw_ghost,
    draw_point,
    legend_below,
    rates_figure,
)
from roboirg.analysis.published import published_rows
from roboirg.analysis.stats.run_summary import ALL
from roboirg.analysis.stats.samples import PolicyRun, Samples
from roboirg.analysis.stats.success_rates import SettingColumn
from roboirg.language import STAGE_SETS

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

HEIGHT_INCHES = 2.4
SHIFT = 0.08


def draw_context(content: FigureData, *, published: bool = False) -> Figure | None:
    """Draw the means over the tasks that were played with every set; None with one set or none."""
    sets = [
        stages
        for stages in STAGE_SETS
        if any(_is(told, stages) for told in _courses(content.samples).values())
    ]
    samples, tasks = _shared(content.samples, sets)
    if not tasks:
        return None
    found = by_key(samples)
    ghosts = published_rows("context") if published else ()
    models = list(dict.fromkeys(row.model for row in ghosts))
    names = [who for who in content.names if any(own == who for own, _, _ in found)]
    figure, axes = rates_figure(HEIGHT_INCHES, len(names) + len(models))
    for number, who in enumerate(names):
        course = []
        for place, stages in enumerate(sets):
            one = found.get((who, ALL, SettingColumn("contextual", stages=stages)))
            if one is not None and one.rate is not None:
                at = place + SHIFT * (number - (len(names) - 1) / 2)
                course.append((at, 100 * float(one.rate)))
                draw_point(axes, at, float(one.rate), one.interval, number, content.name(who))
        axes.plot(*zip(*course, strict=True), color=COLORS[number % len(COLORS)], linewidth=0.8)
    for model in models:
        rows = {row.variant.stages: float(row.average) for row in ghosts if row.model == model}
        known = [(place, rows[stages]) for place, stages in enumerate(sets) if stages in rows]
        for at, value in known:
            draw_ghost(axes, at, value, models.index(model), f"{model} (published)")
        axes.plot(*zip(*known, strict=True), color=GHOST, linewidth=0.6, linestyle=":", zorder=1)
    _set_axes(axes, sets, tasks)
    legend_below(figure, axes)
    return figure


def _set_axes(axes: Axes, sets: list[tuple[int, ...]], tasks: list[str]) -> None:
    axes.set_xticks(range(len(sets)), [",".join(map(str, stages)) for stages in sets])
    axes.set_xlim(-0.4, len(sets) - 0.6)
    axes.set_xlabel(f"stages that are spoken; mean over {', '.join(tasks)}", wrap=True)


def _courses(samples: Samples) -> dict[PolicyRun, set[SettingColumn]]:
    """The sets that each contestant was told, of those who were told several."""
    usual = {SettingColumn("contextual", stages=stages) for stages in STAGE_SETS}
    told: dict[PolicyRun, set[SettingColumn]] = {}
    for (who, _, variant), sample in samples.items():
        if variant in usual and sample.trials:
            told.setdefault(who, set()).add(variant)
    return {who: own for who, own in told.items() if len(own) > 1}


def _is(told: set[SettingColumn], stages: tuple[int, ...]) -> bool:
    return SettingColumn("contextual", stages=stages) in told


def _shared(samples: Samples, sets: list[tuple[int, ...]]) -> tuple[Samples, list[str]]:
    """Of those who were told several sets: the tasks that all of them played with every set."""
    names = _courses(samples)
    wanted = {SettingColumn("contextual", stages=stages) for stages in sets}
    kept = {
        key: sample
        for key, sample in samples.items()
        if key[0] in names and key[2] in wanted and sample.trials
    }
    tasks = [
        task
        for task in dict.fromkeys(task for _, task, _ in kept)
        if all((who, task, told) in kept for who in names for told in wanted)
    ]
    return {key: sample for key, sample in kept.items() if key[1] in tasks}, tasks
