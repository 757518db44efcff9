"""How much of a table fits into one of LaTeX's; the rest becomes further tables."""

from __future__ import annotations

import math
import re
from collections.abc import Sequence
from typing import NamedTuple

from roboirg.evaluation.analysis.tables.rendering.column_parts import split_columns
from roboirg.evaluation.analysis.tables.table import Entry, Row, Table

HUMPS = re.compile(r"(?<=[a-z])(?=[A-Z])|(?<=_)|\s+")
"""Where a heading may be broken: before a capital, behind an underscore, at blanks."""


_ARROWS = {"↑": 0.6, "↓": 0.6, "→": 1.0}
"""Widths of the arrows of changes, in those of a sign."""


class Layout(NamedTuple):
    """The room of a table, and generous widths of what is in it, pt.

    Attributes:
        width: of a table.
        lines: of rows in one table; with caption and notes they fill a page.
        size: of the type.
        letter: width of one.
        digit: of one in bold.
        sign: of a sign behind a rate.
        small: of a digit of a change, on average with its point.
        gap: between columns.
        names: of the rows' names, if they need as much; longer ones are folded.
        narrow_names: of the rows' names, if the columns of a group need the room.
        suites: whether averages of suites are shown, which the paper does not have.
    """

    width: float
    lines: int
    size: str
    letter: float
    digit: float
    sign: float
    small: float
    gap: float
    names: float
    narrow_names: float
    suites: bool

    def text_width(self, text: str) -> float:
        """Return an upper bound of the width of a text."""
        return sum(map(self._sign_width, text))

    def column_width(self, table: Table, index: int) -> int:
        """Return an upper bound of the width of a column with its gap, whole so that sums are."""
        head = max(map(self.text_width, HUMPS.split(table.columns[index].name)))
        entries = (self._entry_width(row.entries[index]) for row in table.rows)
        return math.ceil(max(head, *entries, 0.0) + self.gap)

    def _entry_width(self, entry: Entry) -> float:
        arrow, digits = entry.change_text[:1], entry.change_text[1:]
        change = self.sign * _ARROWS.get(arrow, 0.0) + self.small * len(digits)
        return self.text_width(entry.text) + change + self.sign * len(entry.signs)

    def _sign_width(self, one: str) -> float:
        if one in ".,:":
            return self.digit / 2
        return self.digit if one.isdigit() or one == " " else self.letter


PAGE = Layout(512.0, 60, "scriptsize", 4.2, 3.6, 6.0, 2.4, 4.0, 90.0, 60.0, suites=False)
"""Both columns of IEEEtran's conference class, 516 pt, in Times."""
PIECES = Layout(343.0, 39, "footnotesize", 5.2, 4.9, 7.0, 3.3, 6.0, 130.0, 70.0, suites=True)
"""A one-column article in 10 pt, 345 pt, in Computer Modern."""


class Part(NamedTuple):
    """One of the tables that a wide or long table becomes."""

    indices: Sequence[int]
    rows: Sequence[Row]
    names_pt: float


def parts_of(table: Table, layout: Layout) -> list[Part]:
    """Return the parts of a table that fit, those with the same columns one after the other."""
    shown = [
        index
        for index, column in enumerate(table.columns)
        if layout.suites or not (column.averages and column.group)
    ]
    widths = [layout.column_width(table, index) for index in shown]
    # An average over all columns stands with the last group.
    groups: list[str] = []
    for index in shown:
        groups.append(table.columns[index].group or (groups[-1] if groups else ""))
    names = _names_width(table, layout, _widest_group(groups, widths))
    parts = split_columns(groups, widths, layout.width - names - layout.gap)
    blocks = _blocks(table, layout, names)
    return [
        Part([shown[place] for place in places], rows, names) for places in parts for rows in blocks
    ]


def _widest_group(groups: Sequence[str], widths: Sequence[int]) -> int:
    return max(
        sum(width for width, own in zip(widths, groups, strict=True) if own == group)
        for group in groups
    )


def _names_width(table: Table, layout: Layout, together: float) -> float:
    """Return the width of the names, or of all check marks with their gaps."""
    heads = table.heads[1:]
    if len(heads) > 1:
        return len(heads) * (layout.sign + layout.gap)
    needed = max((layout.text_width(table.names(row)[0]) for row in table.rows), default=0.0)
    room = max(layout.narrow_names, math.floor(layout.width - layout.gap - together))
    return max(min(layout.names, needed, room), layout.text_width(heads[0]))


def _blocks(table: Table, layout: Layout, names_pt: float) -> list[list[Row]]:
    """Return the rows of each table; a group is divided only if it is longer than a table."""
    blocks: list[list[Row]] = [[]]
    used = 0
    for rows in table.groups().values():
        heights = [_height(table, row, layout, names_pt) for row in rows]
        if used and used + sum(heights) + 1 > layout.lines:
            blocks.append([])
            used = 0
        used += 1
        for row, height in zip(rows, heights, strict=True):
            if used + height > layout.lines:
                blocks.append([])
                used = 1
            blocks[-1].append(row)
            used += height
    return blocks


def _height(table: Table, row: Row, layout: Layout, names_pt: float) -> int:
    return int(max(-(-layout.text_width(name) // names_pt) for name in table.names(row))) or 1
