"""Drawing of shares of episodes: a panel for each policy and in it a stacked bar for each row."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, NamedTuple

from roboirg.evaluation.analysis.figures.figure_style import panels, paper

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

MOST_COLUMNS = 2
HEIGHT = 1.55
"""Of a bar, of the two lines of a row."""
MIN_LABELED_PERCENT = 6.0
"""Smallest part with room for its number, percent."""


class Part(NamedTuple):
    """What a part of a bar is, its color, its pattern, and the color of the number in it."""

    label: str
    color: str
    pattern: str = ""
    ink: str = "black"


class Bar(NamedTuple):
    """A row: its label, the episodes in each part, all episodes, and a text at the right.

    One without counts is a heading.
    """

    label: str
    counts: Mapping[str, int]
    episodes: int
    text: str


def draw_bars(
    rows: Mapping[str, Sequence[Bar]], parts: Sequence[Part], notes: Sequence[str]
) -> Figure:
    """Draw the bars of each policy; only parts that occur are in the legend."""
    from matplotlib.patches import Patch

    seen = {
        name for bars in rows.values() for bar in bars for name, one in bar.counts.items() if one
    }
    parts = [part for part in parts if part.label in seen]
    keys = {
        part.label: Patch(facecolor=part.color, hatch=part.pattern, edgecolor=paper())
        for part in parts
    }
    labels = {title: [bar.label for bar in bars] for title, bars in rows.items()}
    headings = {bar.label for bars in rows.values() for bar in bars if not bar.counts}
    figure, found = panels(labels, MOST_COLUMNS, keys, notes, headings=headings)
    for (axes, places), bars in zip(found, rows.values(), strict=True):
        for place, bar in zip(places, bars, strict=True):
            _draw_bar(axes, place, bar, parts)
        axes.set_xlim(0, 100)
        axes.set_xticks(range(0, 101, 25))
        axes.set_xlabel("share of the episodes with a verdict, %", fontsize=6.5)
    return figure


def _draw_bar(axes: Axes, place: float, bar: Bar, parts: Sequence[Part]) -> None:
    left = 0.0
    for part in parts:
        count = bar.counts.get(part.label, 0)
        width = 100 * count / max(1, bar.episodes)
        axes.barh(
            place, width, left=left, height=HEIGHT, color=part.color, hatch=part.pattern,
            edgecolor=paper(), linewidth=0.5,
        )  # fmt: skip
        if width >= MIN_LABELED_PERCENT and not part.pattern:
            axes.text(
                left + width / 2, place, str(count), ha="center", va="center", fontsize=6.5,
                color=part.ink,
            )  # fmt: skip
        left += width
    axes.text(
        1.02, place, bar.text, transform=axes.get_yaxis_transform(), va="center", fontsize=6.5
    )
