"""Tables in LaTeX; the document needs the packages booktabs, xcolor, amssymb, array and graphicx.

A table is never wider than the text of the document: what is wider is scaled down. What is much
wider or longer becomes several tables: by groups of columns, as on the terminal, and by groups of
rows.
"""

from __future__ import annotations

import dataclasses
import itertools
import re
from collections.abc import Iterator, Sequence
from typing import NamedTuple

from roboirg.analysis.tables.rendering.terminal import split_columns
from roboirg.analysis.tables.table import (
    CHECK_MARK,
    PUBLISHED_MARK,
    Column,
    Entry,
    Row,
    Table,
)

_PREAMBLE = r"""% needs \usepackage{booktabs,xcolor,amssymb,array,graphicx}
\providecommand{\roboirgup}[1]{{\tiny\textcolor[rgb]{0,.42,.25}{$\uparrow$#1}}}
\providecommand{\roboirgdown}[1]{{\tiny\textcolor[rgb]{.75,.1,.1}{$\downarrow$#1}}}
\providecommand{\roboirgsame}[1]{{\tiny\textcolor[gray]{.4}{$\rightarrow$#1}}}
\providecommand{\roboirgfit}[1]{\resizebox{\ifdim\width>\textwidth\textwidth\else\width\fi}{!}{#1}}"""
_FLOAT = r"""\begin{{table*}}
\centering\scriptsize
\setlength{{\tabcolsep}}{{2pt}}
\caption{{{caption}.}}
\label{{tab:{label}}}
\roboirgfit{{\begin{{tabular}}{{{columns}}}
\toprule
{lines}
\bottomrule
\end{{tabular}}}}
\par\smallskip{{\raggedright {notes}\par}}
\end{{table*}}"""
_FOLDED = r">{{\raggedright\arraybackslash}}p{{{:g}em}}"
"""A column whose texts are folded, by its width."""
DAGGER = "†"
"""Marks published rows."""
_CHANGES = {"↑": r"\roboirgup", "↓": r"\roboirgdown", "→": r"\roboirgsame"}
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
    CHECK_MARK: r"$\checkmark$",
    DAGGER: r"\textsuperscript{\dag}",
    "\u200b": r"\allowbreak{}",
}
_BREAKS = re.compile(r"[./:_,=?&-](?=[^\s\d])|[^\s./:_,=?&-]{14}(?=\S)")
"""Behind what a long name may be broken: these signs, and 14 letters without one."""
_HUMPS = re.compile(r"(?<=[a-z])(?=[A-Z])|(?<=_)|\s+")
"""Where a heading may be broken: before a capital, behind an underscore, at blanks."""
_ROOM = 220
"""Characters of all columns as on a terminal; more are not legible in a page's width."""
_TEXT_WIDTH = 30
"""Width of a column of texts, in em."""
_LINES = 52
"""Lines of rows in one table; with caption and notes they fill a page."""
_NAME = 30
"""Letters of a row's name in one line; longer ones are folded."""


def latex(table: Table) -> str:
    """Return a table as LaTeX: several floats, each of a page at most, if it is wide or long.

    The averages of suites, which the paper does not have, are left out.
    """
    shown = []
    for number, column in enumerate(table.columns):
        is_suite_average = column.averages and column.group
        if not is_suite_average:
            shown.append(number)
    parts = []
    for numbers in split_columns(table, shown, _ROOM):
        for rows in _blocks(table):
            parts.append(_Part(dataclasses.replace(table, rows=rows), numbers))
    texts = [_PREAMBLE]
    for place, part in enumerate(parts, 1):
        texts.append(_float(part, place, len(parts)))
    return "\n".join(texts) + "\n"


class _Part(NamedTuple):
    """What one table in the document shows.

    Attributes:
        table: with the rows that are shown.
        numbers: of the columns that are shown.
    """

    table: Table
    numbers: list[int]

    @property
    def columns(self) -> list[Column]:
        """The columns that are shown."""
        return [self.table.columns[number] for number in self.numbers]

    @property
    def has_long_names(self) -> bool:
        """Whether names of rows are folded."""
        return any(len(row.name) > _NAME for row in self.table.rows)


def _blocks(table: Table) -> Iterator[list[Row]]:
    """Yield the rows of a table in blocks that fit on a page.

    Rows of a group stay together unless the group alone is longer than a page.
    """
    longest_name = max([len(row.name) for row in table.rows], default=0)
    lines_of_row = 1 + longest_name // _NAME  # names are folded at this many letters
    most = _LINES // lines_of_row  # rows in a table
    block: list[Row] = []
    for group in table.groups():
        for begin in range(0, len(group), most):
            piece = group[begin : begin + most]
            if block and len(block) + len(piece) > most:
                yield block
                block = []
            block += piece
    yield block


def _float(part: _Part, place: int, count: int) -> str:
    """Return the LaTeX of one float; a wide or long table is divided among several.

    Args:
        part: the rows and columns of this one.
        place: its number, from 1, for its caption and label.
        count: number of floats of the table; only the last one has the notes.
    """
    table = part.table
    caption = escaped(table.title)
    if count > 1:
        caption += f" ({place} of {count})"
    label = table.key
    if place > 1:
        label += f"-{place}"
    notes = ""
    if place == count:
        notes = " ".join(map(_foldable, table.notes))
    return _FLOAT.format(
        caption=caption,
        label=label,
        columns=_column_kinds(part),
        lines="\n".join(_lines(part)),
        notes=notes,
    )


def _column_kinds(part: _Part) -> str:
    """Return LaTeX's specification of a table's columns: how each is aligned.

    For example ``lrr``: names to the left, two columns of numbers to the right.
    """
    heads = part.table.heads[1:]  # groups stand in lines of their own
    if part.has_long_names:
        kinds = _FOLDED.format(_NAME / 2)
    elif len(heads) == 1:
        kinds = "l"
    else:
        kinds = "c" * len(heads)
    for column in part.columns:
        kinds += _FOLDED.format(_TEXT_WIDTH) if column.is_text else "r"
    return kinds


def _lines(part: _Part) -> Iterator[str]:
    """Yield the LaTeX lines of a table: headings, then each group below a rule and its name.

    Args:
        part: the table, and which of its columns are shown.
    """
    table = part.table
    columns = part.columns
    heads = list(map(escaped, table.heads[1:]))  # groups stand in lines of their own
    yield from _column_groups(columns, len(heads))
    headings = heads + [_head(column.name) for column in columns]
    yield _line(headings)
    printed = _foldable if part.has_long_names else escaped
    for line in table.lines():
        group, *labels = line.labels
        if line.begins_group:
            yield r"\midrule"
            yield rf"\multicolumn{{{len(headings)}}}{{l}}{{\emph{{{escaped(group)}}}}} \\"
        cells = list(map(printed, labels))
        for number in part.numbers:
            cells.append(_cell(line.row.entries[number], table.columns[number]))
        yield _line(cells)


def _column_groups(columns: Sequence[Column], names: int) -> list[str]:
    """Return the two LaTeX lines above the headings: names of groups of columns, and rules below.

    A group's name is centered over its columns; no rule is below columns without a group.

    Args:
        columns: below the groups; without a group in any there are no such lines.
        names: how many columns with names stand before them.
    """
    if not any(column.group for column in columns):
        return []
    cells = [""] * names
    rules = ""
    first = names + 1  # LaTeX counts columns from 1
    for group, members in itertools.groupby(column.group for column in columns):
        width = len(list(members))
        last = first + width - 1
        cells.append(rf"\multicolumn{{{width}}}{{c}}{{{escaped(group)}}}")
        if group:
            rules += rf"\cmidrule(lr){{{first}-{last}}}"
        first = last + 1
    return [_line(cells), rules]


def _head(name: str) -> str:
    """Return the LaTeX of a heading with its words stacked: Pick above Xtimes of ``PickXtimes``."""
    words = list(map(escaped, _HUMPS.split(name)))
    if len(words) == 1:
        return words[0]
    # Invisible letters keep the lines equally high.
    stacked = r"\\".join(rf"{word}\vphantom{{Ag}}" for word in words)
    return rf"\shortstack[r]{{{stacked}}}"


def _line(cells: list[str]) -> str:
    return " & ".join(cells) + r" \\"


def _cell(entry: Entry, column: Column) -> str:
    """Return the LaTeX of an entry: its text, bold if the best, then its change, then its signs.

    The change from the reference is a small colored arrow with a number, as ``↑1.33`` has.
    """
    text = _foldable(entry.text) if column.is_text else escaped(entry.text)
    if entry.best:
        text = rf"\textbf{{{text}}}"
    change = entry.change_text
    if change:
        arrow = change[0]
        number = change[1:]
        text += rf"{_CHANGES[arrow]}{{{number}}}"
    if entry.signs:
        text += rf"\textsuperscript{{{escaped(entry.signs)}}}"
    return text


def _foldable(text: str) -> str:
    """Return a text that may be broken within long names, too: at spaces without a width."""
    return escaped(_BREAKS.sub("\\g<0>\u200b", text))


def escaped(text: str) -> str:
    """Return a text as the format prints it; a dagger marks published rows."""
    marked = text.replace(PUBLISHED_MARK, DAGGER).replace(PUBLISHED_MARK.strip(), DAGGER)
    return "".join(_SPECIAL.get(sign, sign) for sign in marked)
