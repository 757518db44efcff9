"""Referring expressions: how many scenes have each class, by setting, and their figure."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, get_args

import msgspec

from roboirg import language
from roboirg.core.errors import RoboIRGError
from roboirg.evaluation.analysis.figures.figure_style import clear_axes, new_figure, save
from roboirg.evaluation.analysis.stats.run_data import RunData
from roboirg.evaluation.play.job_instruction import instruct_job
from roboirg.evaluation.records.record import Job
from roboirg.language.instruction import Expression, Instruction
from roboirg.language.settings import EXPLICIT, all_settings

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

TITLE = "Referring expressions in the instructions"
PANEL_INCHES, SIDE_INCHES = 2.6, 0.9
ROW_INCHES, MARGIN_INCHES = 0.29, 1.25
PANEL_RANGE = 1.25
"""Width of a panel in units of the longest bar; leaves space for its number."""

ClassCounts = Mapping[str, Mapping[str, int]]
"""ClassCounts by group (setting or task), then by class."""


def expression_counts(instructions: Iterable[Instruction]) -> ClassCounts:
    """Count the scenes with each expression class, by setting.

    A scene counts once for a setting, even if it has several instructions there.
    """
    scenes = {
        (instruction.setting, instruction.episode, mention.expression)
        for instruction in instructions
        for mention in instruction.mentions
        if mention.expression is not None
    }
    counts: dict[str, Counter[str]] = {}
    for setting, _, expression in sorted(scenes):
        counts.setdefault(setting, Counter())[expression] += 1
    return counts


def expression_order(counts: ClassCounts) -> tuple[str, ...]:
    """Return the classes that occur, in the order of their definition."""
    found = {name for one in counts.values() for name in one}
    return tuple(name for name in get_args(Expression) if name in found)


def scene_counts(instructions: Iterable[Instruction]) -> Mapping[str, int]:
    """Count the scenes by setting."""
    scenes = {(instruction.setting, instruction.episode) for instruction in instructions}
    return Counter(setting for setting, _ in scenes)


def write_expressions(content: RunData, folder: Path, name: str) -> tuple[Path, ...]:
    """Draw the referring expressions of the runs; return no files without implicit instructions.

    Results do not hold the instructions, so they are generated again, if the language has the same
    version.
    """
    jobs = [
        msgspec.structs.replace(
            result.identity, policy="", policy_seed=0, wordings_file=result.wordings_file
        )
        for _, result in content.results
        if result.form == "implicit" and result.setting != EXPLICIT
        if result.language_version == language.LANGUAGE_VERSION
    ]
    found = [one for job in dict.fromkeys(jobs) if (one := _instruction(job)) is not None]
    return write_figure(found, folder, name, TITLE) if found else ()


def _instruction(job: Job) -> Instruction | None:
    try:
        return instruct_job(job)
    except RoboIRGError:
        return None  # a task that is no longer installed


def write_figure(
    instructions: Sequence[Instruction], folder: Path, name: str, title: str
) -> tuple[Path, ...]:
    """Draw the number of scenes with each class of referring expression.

    Return the files; `name` has no extension.
    """
    return save(lambda: _draw(instructions, title), folder, name)


def _draw(instructions: Sequence[Instruction], title: str) -> Figure:
    from matplotlib.ticker import MaxNLocator

    counts, scenes = expression_counts(instructions), scene_counts(instructions)
    settings = [setting for setting in all_settings() if setting in counts]
    classes = expression_order(counts)
    size = (
        PANEL_INCHES * max(1, len(settings)) + SIDE_INCHES,
        ROW_INCHES * len(classes) + MARGIN_INCHES,
    )
    figure = new_figure(*size)
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
    clear_axes(panel, grid="x")
