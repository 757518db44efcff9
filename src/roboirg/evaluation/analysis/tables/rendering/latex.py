"""Tables in LaTeX; the document needs the package booktabs.

A table is no wider than the text of a one-column article, so it fits there, and across both columns
of a two-column one. What is wider or longer becomes several tables: by groups of columns, as on the
terminal, and by groups of rows.
"""

from __future__ import annotations

import itertools
import math
import re
from collections.abc import Iterator, Sequence
from typing import NamedTuple

from roboirg.evaluation.analysis.tables.rendering.column_parts import split_columns
from roboirg.evaluation.analysis.tables.table import NOT_APPLICABLE, Column, Entry, Row, Table

TEXT_WIDTH_PT = 343.0
"""Width of a table: a little less than the 345 pt of a one-column article in 10 pt."""
MOST_LINES = 42
"""Lines of rows in one table, in \\footnotesize; with caption and notes they fill a page."""
_LETTER_PT, _DIGIT_PT, _SIGN_PT, _GAP_PT = 5.2, 4.9, 7.0, 6.0
"""Generous widths in \\footnotesize: of a letter, of a digit in bold, of a sign or arrow, and
between columns."""
_ARROW_PT = {"up": 6.0, "down": 6.0, "same": 10.0}
_NAMES_PT, _NARROW_NAMES_PT = 130.0, 70.0
"""Widths of the rows' names, if they need as much, and if the columns of a group need the room;
longer ones are folded."""

_ARROWS = {"up": r"$\uparrow$", "down": r"$\downarrow$", "same": r"$\rightarrow$"}
_SPECIAL = {
    "\\": r"\textbackslash{}",
    "~": r"\textasciitilde{}",
    "^": r"\textasciicircum{}",
    **{sign: f"\\{sign}" for sign in "&%$#_{}"},
    "–": "--",
    "…": r"\ldots{}",
    "−": "$-$",
    "±": r"$\pm$",
    "<": "$<$",
    ">": "$>$",
    "|": "$|$",
    "×": r"$\times$",
    "π": r"$\pi$",
    "↑": r"$\uparrow$",
    "↓": r"$\downarrow$",
    "→": r"$\rightarrow$",
    "≠": r"$\neq$",
}
_HUMPS = re.compile(r"(?<=[a-z])(?=[A-Z])|(?<=_)|\s+")
"""Where a heading may be broken: before a capital, behind an underscore, at blanks."""
_BREAKS = frozenset("./:_-,=?&")
"""Signs behind which a long name may be broken."""
_MOST_LETTERS = 14
"""Letters of a name behind which it may be broken in any case."""


class _Part(NamedTuple):
    """One of the tables that a wide or long table becomes."""

    indices: Sequence[int]
    rows: Sequence[Row]
    names_pt: float


def latex(table: Table) -> str:
    """Return table environments with rules between groups of columns and of rows."""
    lines = ["% needs \\usepackage{booktabs}"]
    parts = _parts(table)
    for number, part in enumerate(parts, start=1):
        lines += _float(table, part, number, len(parts))
    return "\n".join(lines) + "\n"


def _parts(table: Table) -> list[_Part]:
    # Whole numbers, whose sums are exact.
    widths = [
        math.ceil(_column_width(table, index) + _GAP_PT) for index in range(len(table.columns))
    ]
    # An average over all columns stands with the last group.
    groups: list[str] = []
    for column in table.columns:
        groups.append(column.group or (groups[-1] if groups else ""))
    needed = max((_width(row.label) for row in table.rows), default=0.0)
    together = max(
        sum(width for width, own in zip(widths, groups, strict=True) if own == group)
        for group in groups
    )
    room = max(_NARROW_NAMES_PT, math.floor(TEXT_WIDTH_PT - _GAP_PT - together))
    names = max(min(_NAMES_PT, needed, room), _width(table.heads[1]))
    columns = split_columns(groups, widths, TEXT_WIDTH_PT - names - _GAP_PT)
    blocks = _blocks(table, names)
    return [_Part(indices, rows, names) for indices in columns for rows in blocks]


def _blocks(table: Table, names_pt: float) -> list[list[Row]]:
    """Return the rows of each table; a group is divided only if it is longer than a table."""
    blocks: list[list[Row]] = [[]]
    used = 0
    for rows in table.groups().values():
        heights = [-(-_width(row.label) // names_pt) for row in rows]
        if used and used + sum(heights) + 1 > MOST_LINES:
            blocks.append([])
            used = 0
        used += 1
        for row, height in zip(rows, heights, strict=True):
            if used + height > MOST_LINES:
                blocks.append([])
                used = 1
            blocks[-1].append(row)
            used += int(height)
    return blocks


def _float(table: Table, part: _Part, number: int, count: int) -> Iterator[str]:
    columns = [table.columns[index] for index in part.indices]
    caption, label = _escaped(table.title), f"tab:{table.key}"
    if count > 1:
        caption += f" ({number} of {count})"
        label += f"-{number}" if number > 1 else ""
    first = rf"p{{{part.names_pt:.0f}pt}}"
    yield r"\begin{table*}"
    yield r"\centering\footnotesize"
    yield rf"\setlength{{\tabcolsep}}{{{_GAP_PT / 2:.0f}pt}}"
    yield rf"\caption{{{caption}.}}"
    yield rf"\label{{{label}}}"
    yield rf"\begin{{tabular}}{{{first}{'r' * len(columns)}}}"
    yield r"\toprule"
    yield from _column_groups(columns)
    yield _line([_escaped(table.heads[1]), *(_head(column.name) for column in columns)])
    for group, rows in itertools.groupby(part.rows, key=lambda row: row.group):
        yield r"\midrule"
        yield rf"\multicolumn{{{len(columns) + 1}}}{{l}}{{\emph{{{_escaped(group)}}}}} \\"
        for row in rows:
            cells = [_cell(row.entries[index]) for index in part.indices]
            yield _line([rf"\raggedright {_foldable(row.label)}", *cells])
    yield r"\bottomrule"
    yield r"\end{tabular}"
    if number == count:
        yield rf"\par\smallskip{{\raggedright {_foldable(' '.join(table.notes))}\par}}"
    yield r"\end{table*}"


def _column_groups(columns: Sequence[Column]) -> list[str]:
    if not any(column.group for column in columns):
        return []
    cells, rules, place = [""], [], 2
    for name, members in itertools.groupby(column.group for column in columns):
        width = len(list(members))
        cells.append(
            rf"\multicolumn{{{width}}}{{c}}{{{_escaped(name)}}}" if name else " & " * (width - 1)
        )
        if name:
            rules.append(rf"\cmidrule(lr){{{place}-{place + width - 1}}}")
        place += width
    return [_line(cells), "".join(rules)]


def _column_width(table: Table, index: int) -> float:
    """Return an upper bound of the width of a column, pt."""
    head = max(_width(word) for word in _HUMPS.split(table.columns[index].name))
    return max(head, *(_entry_width(row.entries[index]) for row in table.rows), 0.0)


def _entry_width(entry: Entry) -> float:
    arrow = _ARROW_PT[entry.change] if entry.change else 0.0
    return _width(entry.text) + arrow + _SIGN_PT * len(entry.signs)


def _width(text: str) -> float:
    return sum(_DIGIT_PT if sign.isdigit() or sign in " .,:" else _LETTER_PT for sign in text)


def _head(name: str) -> str:
    """Return a heading with a line for each of its words."""
    words = [_escaped(word) for word in _HUMPS.split(name)]
    stacked = r"\\".join(words)
    return stacked if len(words) == 1 else rf"\shortstack[r]{{{stacked}}}"


def _line(cells: list[str]) -> str:
    return " & ".join(cells) + r" \\"


def _cell(entry: Entry) -> str:
    text = "--" if entry.text == NOT_APPLICABLE else _escaped(entry.text)
    if entry.best:
        text = rf"\textbf{{{text}}}"
    if entry.change:
        text += rf"\,{_ARROWS[entry.change]}"
    if entry.signs:
        text += rf"\textsuperscript{{{_escaped(entry.signs)}}}"
    return text


def _foldable(text: str) -> str:
    """Return text that may be broken within long names, too."""
    found, run = [], 0
    for sign in text:
        run = 0 if sign in _BREAKS or sign == " " else run + 1
        may_break = sign in _BREAKS or run == _MOST_LETTERS
        found.append(_escaped(sign) + (r"\allowbreak{}" if may_break else ""))
        run = 0 if may_break else run
    return "".join(found)


def _escaped(text: str) -> str:
    return "".join(_SPECIAL.get(sign, sign) for sign in text)
