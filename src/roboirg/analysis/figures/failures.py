"""Figure: causes of failures, a panel for each policy and in it a stacked bar for each setting."""

from __future__ import annotations

import functools
import itertools
from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from typing import TYPE_CHECKING

from roboirg.analysis.figures.figure_style import SMALL_POINTS, paper
from roboirg.analysis.figures.panels import Panel, RowLabel, panels
from roboirg.analysis.measures.run_data import RunData
from roboirg.analysis.palette import palette
from roboirg.analysis.results.option_labels import options_sort_key
from roboirg.analysis.results.policy_run import PolicyRun
from roboirg.analysis.tables.diagnostic_tables import (
    FAILURE_KINDS,
    count_failures,
    occurring_failures,
)
from roboirg.analysis.tables.table_notes import where_played
from roboirg.core.instruction_options import InstructionOptions, options_label

if TYPE_CHECKING:
    from matplotlib.artist import Artist
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

MOST_COLUMNS = 2
HEIGHT = 1.55
"""Of a bar, of the two lines of a row."""
MIN_LABELED_PERCENT = 6.0
"""Smallest part with room for its number, percent."""
NOTE = "n: trials with a verdict; the rest of a bar succeeded."


@functools.cache
def failure_colors() -> Mapping[str, str]:
    """Return a color by name of the failure; if a kind has more names, its colors come again."""
    shades = {kind: itertools.cycle(colors) for kind, colors in palette().failures.items()}
    return {name: next(shades[kind or "undecided"]) for name, kind in FAILURE_KINDS.items()}


def draw_failures(content: RunData) -> Figure | None:
    """Draw bars of how episodes failed: a panel for each policy, a bar for each setting.

    A bar has a part for each cause, as long as its share of the episodes with a verdict. None
    without failures.
    """
    counts_by_bar = count_failures(content.frame, ("run", "options"))
    causes = occurring_failures(counts_by_bar.values())
    if not causes:
        return None
    runs = list(dict.fromkeys(run for run, _ in counts_by_bar))
    settings = sorted({options for _, options in counts_by_bar}, key=options_sort_key)
    figure, drawn = _empty_panels(content, runs, settings, causes)
    for panel, run in zip(drawn, runs, strict=True):
        bars = [counts_by_bar.get((run, options), Counter()) for options in settings]
        _draw_bars(panel, bars, causes)
    return figure


def _empty_panels(
    content: RunData,
    runs: Sequence[PolicyRun],
    settings: Iterable[InstructionOptions],
    causes: Iterable[str],
) -> tuple[Figure, list[Panel]]:
    """Lay out a panel for each policy run, with a row for each setting and the legend below."""
    return panels(
        titles=list(map(content.name, runs)),
        labels=[RowLabel(options_label(options)) for options in settings],
        most_across=MOST_COLUMNS,
        keys=_keys(causes),
        notes=[NOTE, where_played(runs)],
    )


def _draw_bars(panel: Panel, bars: Sequence[Counter[str]], causes: Sequence[str]) -> None:
    """Draw a bar for each row of a panel, with the scale below.

    Args:
        panel: of a policy.
        bars: for each row the number of trials with a verdict, and failures by cause.
        causes: the parts of the bars from left to right.
    """
    for place, counts in zip(panel.places, bars, strict=True):
        _draw_bar(panel.axes, place, counts, causes)
    panel.set_scale(100, 25, "share of the episodes with a verdict, %")


def _keys(causes: Iterable[str]) -> dict[str, Artist]:
    """Return the entries of the legend: for each cause of failure its label and its color.

    A label is kind and name, such as ``grounding: wrong object``.
    """
    from matplotlib.patches import Patch

    keys: dict[str, Artist] = {}
    for name in causes:
        label = name.replace("_", " ")
        if FAILURE_KINDS[name]:
            label = f"{FAILURE_KINDS[name]}: {label}"
        keys[label] = Patch(facecolor=failure_colors()[name], edgecolor=paper())
    return keys


def _draw_bar(axes: Axes, place: float, counts: Counter[str], causes: Sequence[str]) -> None:
    """Draw a bar with a part for each cause of failure, and the number of trials to its right.

    Args:
        axes: of the panel.
        place: vertical position of the bar.
        counts: trials with a verdict, and failures by cause.
        causes: the parts of the bar from left to right.
    """
    colors = failure_colors()
    trials = counts["trials"]
    left = 0.0
    for name in causes:
        width = 100 * counts[name] / max(1, trials)
        axes.barh(
            place,
            width,
            left=left,
            height=HEIGHT,
            color=colors[name],
            edgecolor=paper(),
            linewidth=0.5,
        )
        if width >= MIN_LABELED_PERCENT:
            axes.text(
                left + width / 2,
                place,
                str(counts[name]),
                ha="center",
                va="center",
                fontsize=SMALL_POINTS,
                color="white" if colors[name] in palette().below_white else "black",
            )
        left += width
    text = f"n = {trials}" if trials else "–"
    axes.text(
        1.02, place, text, transform=axes.get_yaxis_transform(), va="center", fontsize=SMALL_POINTS
    )
