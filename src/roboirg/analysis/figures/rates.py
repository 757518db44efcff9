"""Drawing of rates: a panel for each column and in it a row for each policy."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from typing import TYPE_CHECKING, Any, NamedTuple

from roboirg.analysis.figures.figure_style import first_color, ghost, paper
from roboirg.analysis.figures.panels import Panel, RowLabel, panels
from roboirg.stats.intervals import Interval
from roboirg.stats.rates import points

if TYPE_CHECKING:
    from matplotlib.artist import Artist
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure
    from matplotlib.lines import Line2D

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


class RateWords(NamedTuple):
    """What the legend calls rates next to each other.

    Attributes:
        reference: one that others are compared with.
        compared: one next to a reference.
    """

    reference: str
    compared: str


def draw_rates(
    columns: Mapping[str, str],
    rows: Sequence[RateRow],
    words: RateWords,
    notes: Sequence[str],
) -> Figure:
    """Draw success rates as dots: a panel for each column, a row for each policy.

    A row without rates is a heading; the rows below it are gray.

    Args:
        columns: title of each panel and what is below its axis.
        rows: from the top down.
        words: of the legend.
        notes: sentences below the legend.
    """
    labels = []
    rates: list[Rate] = []
    for row in rows:
        labels.append(RowLabel(row.label, is_heading=not row.rates))
        rates += row.rates.values()
    figure, drawn = panels(
        titles=list(columns),
        labels=labels,
        most_across=MOST_COLUMNS,
        keys=_keys(rates, words),
        notes=notes,
    )
    end = _end_of_scale(rates)
    # A narrow panel has no room for all numbers.
    tick = TICK if len(columns) < MOST_COLUMNS else 2 * TICK
    for panel, (column, below) in zip(drawn, columns.items(), strict=True):
        _draw_column(panel, column, rows)
        panel.set_scale(end, tick, below, margin=0.06)  # for the dots at both ends
    return figure


def _end_of_scale(rates: Iterable[Rate]) -> int:
    """Return the end of the axis in percent: the first multiple of `TICK` that no rate exceeds."""
    most = 0.0
    for rate in rates:
        most = max(most, rate.value, rate.reference or 0)
    whole_percent = int(100 * most + 0.999)  # rounding errors aside, rounded up
    return TICK * max(1, math.ceil(whole_percent / TICK))


def _draw_column(panel: Panel, column: str, rows: Sequence[RateRow]) -> None:
    """Draw one panel: the rate of each row in a column.

    Rows below a heading, a row without rates, are gray, with a line above the heading.
    """
    color = first_color()
    for place, row in zip(panel.places, rows, strict=True):
        if not row.rates:
            color = ghost()
            panel.axes.axhline(place - 1, color=color, linewidth=0.6)
        if column in row.rates:
            _draw_rate(panel.axes, place, row.rates[column], color)


def _draw_rate(axes: Axes, place: float, rate: Rate, color: str) -> None:
    """Draw a success rate as a dot, with an empty dot for its reference and a band as its interval.

    The difference in points is printed to the right of the panel.
    Band and line are drawn first, because dots lie on them.
    """
    value = 100 * rate.value
    if rate.interval is not None:
        # The interval of a difference begins at the reference.
        begin = rate.reference or 0
        ends = [100 * (end + begin) for end in rate.interval]
        axes.plot(ends, [place, place], color=color, **BAND)
    if rate.reference is not None:
        reference = 100 * rate.reference
        axes.plot([reference, value], [place, place], color=color, linewidth=1.3)
        axes.plot(reference, place, "o", color=color, markersize=DOT, markerfacecolor=paper())
        difference = points(rate.value - rate.reference)
        right = axes.get_yaxis_transform()  # the text is to the right of the panel
        axes.text(1.02, place, difference, transform=right, va="center")
    axes.plot(value, place, "o", color=color, markersize=DOT)


def _keys(rates: Sequence[Rate], words: RateWords) -> dict[str, Artist]:
    """Return the entries of the legend, of those that some rate needs: dots, and the interval.

    The meaning of a dot and of the interval depends on whether rates have references.
    """
    from matplotlib.lines import Line2D

    is_compared = False
    interval_label = ""
    for rate in rates:
        if rate.reference is not None:
            is_compared = True
        if rate.interval and not interval_label:
            interval_label = "95 % interval"
        if rate.interval and rate.reference is not None:
            interval_label = "95 % interval of the difference"
    keys: dict[str, Artist] = {}
    if is_compared:
        keys[f"{words.reference}, %"] = _key_dot(paper())
        keys[f"{words.compared}; number: difference"] = _key_dot(ghost())
    else:
        keys["success, %"] = _key_dot(ghost())
    if interval_label:
        keys[interval_label] = Line2D([], [], color=ghost(), **BAND)
    return keys


def _key_dot(filling: str) -> Line2D:
    from matplotlib.lines import Line2D

    return Line2D(
        [],
        [],
        color=ghost(),
        marker="o",
        linestyle="none",
        markersize=DOT,
        markerfacecolor=filling,
    )
