"""Referring expressions: how many scenes have each class, by setting, and their figure."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, get_args

from roboirg.core.plain_text import counted
from roboirg.evaluation.analysis.figures.figure_style import panels, save
from roboirg.language.instruction import Expression, Instruction
from roboirg.language.settings import all_settings

if TYPE_CHECKING:
    from matplotlib.figure import Figure

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


def write_figure(
    instructions: Sequence[Instruction], folder: Path, name: str, title: str
) -> tuple[Path, ...]:
    """Draw the number of scenes with each class of referring expression.

    Return the files, none without such expressions; `name` has no extension.
    """
    return save(lambda: _draw(instructions, title), folder, name)


def _draw(instructions: Sequence[Instruction], title: str) -> Figure | None:
    from matplotlib.ticker import MaxNLocator

    counts, scenes = expression_counts(instructions), scene_counts(instructions)
    settings = [setting for setting in all_settings() if setting in counts]
    if not settings:
        return None
    classes = expression_order(counts)
    most = max(number for one in counts.values() for number in one.values())
    notes = [f"{title}: scenes in which each occurs."]
    figure, found = panels(dict.fromkeys(settings, classes), len(settings), {}, notes)
    for (axes, places), setting in zip(found, settings, strict=True):
        numbers = [counts[setting].get(one, 0) for one in classes]
        bars = axes.barh(places, numbers, color=all_settings()[setting].color, height=1.5)
        axes.bar_label(bars, [str(one) if one else "" for one in numbers], padding=3)
        axes.set_xlabel(f"of {counted(scenes[setting], 'scene')}", fontsize=6.5)
        # One scale, to compare bars across panels.
        axes.set_xlim(0, PANEL_RANGE * most)
        axes.xaxis.set_major_locator(MaxNLocator(nbins=3, integer=True))
    return figure
