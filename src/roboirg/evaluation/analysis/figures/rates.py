"""Drawing of rates: a panel for each column and in it a row for each policy."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any, NamedTuple

from roboirg.evaluation.analysis.figures.figure_style import (
    GHOST,
    first_color,
    panels,
    paper,
)
from roboirg.evaluation.analysis.stats.intervals import Interval
from roboirg.evaluation.analysis.stats.rates import points

if TYPE_CHECKING:
    from matplotlib.artist import Artist
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

MOST_COLUMNS = 5
TICK = 25
"""The scale ends at a multiple of this, percent."""
DOT = 4.8
"""Size of a rate, points."""
BAND: Mapping[str, Any] = {"linewidth": 6.5, "alpha": 0.3, "solid_capstyle": "butt"}
"""An interval."""


class Rate(NamedTuple):
    """A rate, alone or next to the one that it is compared with, all from 0 to 1.

    Attributes:
        value: the rate.
        reference: the other one; None if there is none.
        interval: of the difference, or of the rate alone; None if unknown.
    """

    value: float
    reference: float | None = None
    interval: Interval | None = None


class RateRow(NamedTuple):
    """A label and its rates by column; without rates the heading of the rows below it."""

    label: str
    rates: Mapping[str, Rate]


def draw_rates(
    columns: Mapping[str, str],
    rows: Sequence[RateRow],
    words: tuple[str, str, str],
    notes: Sequence[str],
) -> Figure:
    """Draw rates, those below a heading in gray.

    Args:
        columns: title of each panel and what is below its axis.
        rows: from the top down.
        words: what the legend calls a rate that stands alone, the reference, and a rate next to it.
        notes: sentences below the legend.
    """
    labels = dict.fromkeys(columns, tuple(row.label for row in rows))
    headings = [row.label for row in rows if not row.rates]
    rates = [rate for row in rows for rate in row.rates.values()]
    most = 100 * max(max(one.value, one.reference or 0) for one in rates)
    end = max(TICK, TICK * -(-int(most + 0.999) // TICK))
    figure, found = panels(labels, MOST_COLUMNS, _keys(rates, words), notes, headings=headings)
    for (axes, places), (column, below) in zip(found, columns.items(), strict=True):
        color = first_color()
        for place, row in zip(places, rows, strict=True):
            if not row.rates:
                color = GHOST
                axes.axhline(place - 1, color=GHOST, linewidth=0.6)
            if column in row.rates:
                _draw_rate(axes, place, row.rates[column], color)
        axes.set_xlim(-0.04 * end, 1.04 * end)
        axes.set_xticks(range(0, end + 1, TICK if len(columns) < MOST_COLUMNS else 2 * TICK))
        axes.set_xlabel(below, fontsize=6.5)
    return figure


def _draw_rate(axes: Axes, place: float, rate: Rate, color: str) -> None:
    if rate.interval is not None:
        ends = [100 * (end + (rate.reference or 0)) for end in rate.interval]
        axes.plot(ends, [place, place], color=color, **BAND)
    if rate.reference is not None:
        fall = [100 * rate.reference, 100 * rate.value]
        axes.plot(fall, [place, place], color=color, linewidth=1.3)
        axes.plot(fall[0], place, "o", color=color, markersize=DOT, markerfacecolor=paper())
        axes.text(
            1.02, place, points(rate.value - rate.reference),
            transform=axes.get_yaxis_transform(), va="center", fontsize=7,
        )  # fmt: skip
    axes.plot(100 * rate.value, place, "o", color=color, markersize=DOT)


def _keys(rates: Sequence[Rate], words: tuple[str, str, str]) -> dict[str, Artist]:
    from matplotlib.lines import Line2D

    def dot(filling: str) -> Line2D:
        return Line2D(
            [], [], color=GHOST, marker="o", linestyle="none", markersize=DOT,
            markerfacecolor=filling,
        )  # fmt: skip

    alone, reference, other = words
    compared = [rate for rate in rates if rate.reference is not None]
    keys: dict[str, Artist] = {}
    if compared:
        keys[f"{reference}, %"] = dot(paper())
    keys[f"{other}; number: difference" if compared else f"{alone}, %"] = dot(GHOST)
    if any(rate.interval for rate in rates):
        what = " of the difference" if any(rate.interval for rate in compared) else ""
        keys[f"95 % interval{what}"] = Line2D([], [], color=GHOST, **BAND)
    return keys
