"""Figure: causes of failures, a panel for each policy and in it a stacked bar for each setting."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from typing import TYPE_CHECKING

from roboirg.evaluation.analysis.figures.figure_style import panels, paper
from roboirg.evaluation.analysis.results.option_labels import options_label, options_sort_key
from roboirg.evaluation.analysis.stats.run_data import RunData
from roboirg.evaluation.analysis.tables.diagnostic_tables import FAILURES, count_failures
from roboirg.evaluation.analysis.tables.table_notes import where_played

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

MOST_COLUMNS = 2
HEIGHT = 1.55
"""Of a bar, of the two lines of a row."""
MIN_LABELED_PERCENT = 6.0
"""Smallest part with room for its number, percent."""
_ORANGE = (
    "#7f2704", "#a63603", "#c0510a", "#dd6a1c", "#ee8130", "#fbb477", "#fddfbf", "#fff1e3",
)  # fmt: skip
_BLUE = (
    "#08306b", "#20578f", "#3271a8", "#4b90c4", "#74b0d8", "#a9d0e8", "#d9ebf6", "#edf5fb",
)  # fmt: skip
_GRAY = ("#5f5f5f", "#858585", "#ababab", "#cfcfcf")
_DARK = frozenset((*_ORANGE[:4], *_BLUE[:4], *_GRAY[:2]))
NOTE = "n: trials with a verdict; the rest of a bar succeeded."


COLORS = dict(zip(FAILURES, (*_ORANGE, *_BLUE, *_GRAY, "#eeeeee"), strict=True))
"""By name of the failure: orange for grounding, blue for execution, gray for undecided."""


def draw_failures(content: RunData) -> Figure | None:
    """Draw the shares of episodes by cause of failure; return None without failures."""
    from matplotlib.patches import Patch

    counts = count_failures(content.frame, ("run", "options"))
    shown = [name for name in COLORS if any(own[name] for own in counts.values())]
    if not shown:
        return None
    columns = sorted({options for _, options in counts}, key=options_sort_key)
    runs = [one for one in content.frame.names if any(run == one for run, _ in counts)]
    labels = {content.name(run): list(map(options_label, columns)) for run in runs}
    keys = {}
    for name in shown:
        words = filter(None, (FAILURES[name], name.replace("_", " ")))
        keys[": ".join(words)] = Patch(facecolor=COLORS[name], edgecolor=paper())
    notes = [NOTE, where_played([one.conditions for one in runs])]
    figure, found = panels(labels, MOST_COLUMNS, keys, notes)
    for (axes, places), run in zip(found, runs, strict=True):
        for place, options in zip(places, columns, strict=True):
            _draw_bar(axes, place, counts.get((run, options), Counter()), shown)
        axes.set_xlim(0, 100)
        axes.set_xticks(range(0, 101, 25))
        axes.set_xlabel("share of the episodes with a verdict, %", fontsize=6.5)
    return figure


def _draw_bar(axes: Axes, place: float, counts: Counter[str], shown: Sequence[str]) -> None:
    left = 0.0
    trials = counts["trials"]
    for name in shown:
        width = 100 * counts[name] / max(1, trials)
        axes.barh(
            place, width, left=left, height=HEIGHT, color=COLORS[name], edgecolor=paper(),
            linewidth=0.5,
        )  # fmt: skip
        if width >= MIN_LABELED_PERCENT:
            axes.text(
                left + width / 2, place, str(counts[name]), ha="center", va="center", fontsize=6.5,
                color="white" if COLORS[name] in _DARK else "black",
            )  # fmt: skip
        left += width
    text = f"n = {trials}" if trials else "–"
    axes.text(1.02, place, text, transform=axes.get_yaxis_transform(), va="center", fontsize=6.5)
