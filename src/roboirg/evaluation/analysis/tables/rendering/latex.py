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

from roboirg.evaluation.analysis.tables.rendering.terminal import split_columns
from roboirg.evaluation.analysis.tables.table import (
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
_LINES = 52
"""Lines of rows in one table; with caption and notes they fill a page."""
_NAME = 30
"""Letters of a row's name in one line; longer ones are folded."""


def latex(table: Table) -> str:
    """Return table environments with rules between groups of columns and of rows.

    The averages of suites, which the paper does not have, are left out.
    """
    columns = enumerate(table.columns)
    shown = [index for index, one in columns if not (one.averages and one.group)]
    parts = [
        (indices, dataclasses.replace(table, rows=tuple(rows)))
        for indices in split_columns(table, shown, _ROOM)
        for rows in _blocks(table)
    ]
    floats = (_float(block, at, number, len(parts)) for number, (at, block) in enumerate(parts, 1))
    return "\n".join([_PREAMBLE, *floats, ""])


def _blocks(table: Table) -> Iterator[list[Row]]:
    """Yield the rows of each table; a group is divided only if it is longer than a table."""
    most = _LINES // max([1 + len(row.name) // _NAME for row in table.rows], default=1)
    block: list[Row] = []
    for group in table.groups():
        for at in range(0, len(group), most):
            piece = group[at : at + most]
            if block and len(block) + len(piece) > most:
                yield block
                block = []
            block += piece
    yield block


def _float(table: Table, indices: list[int], number: int, count: int) -> str:
    columns = [table.columns[index] for index in indices]
    heads = [*map(escaped, table.heads[1:])]
    is_long = any(len(row.name) > _NAME for row in table.rows)
    names = "l" if len(heads) == 1 else "c" * len(heads)
    if is_long:
        names = _FOLDED.format(_NAME / 2)
    sides = [_FOLDED.format(30) if column.is_text else "r" for column in columns]
    lines = _column_groups(columns, len(heads))
    lines.append(_line([*heads, *(_head(column.name) for column in columns)]))
    for begins, labels, row in table.lines():
        if begins:
            group = rf"{{l}}{{\emph{{{escaped(labels[0])}}}}}"
            lines += [r"\midrule", rf"\multicolumn{{{len(heads + indices)}}}{group} \\"]
        cells = [_cell(row.entries[index], table.columns[index]) for index in indices]
        lines.append(_line([*map(_foldable if is_long else escaped, labels[1:]), *cells]))
    return _FLOAT.format(
        caption=escaped(table.title) + (f" ({number} of {count})" if count > 1 else ""),
        label=table.key + (f"-{number}" if number > 1 else ""),
        columns=names + "".join(sides),
        lines="\n".join(lines),
        notes=" ".join(map(_foldable, table.notes)) if number == count else "",
    )


def _column_groups(columns: Sequence[Column], names: int) -> list[str]:
    if not any(column.group for column in columns):
        return []
    cells = [""] * names
    rules = ""
    place = names + 1
    for name, members in itertools.groupby(column.group for column in columns):
        width = len(list(members))
        cells.append(rf"\multicolumn{{{width}}}{{c}}{{{escaped(name)}}}")
        rules += rf"\cmidrule(lr){{{place}-{place + width - 1}}}" if name else ""
        place += width
    return [_line(cells), rules]


def _head(name: str) -> str:
    """Return a heading with a line for each of its words."""
    words = [escaped(word) for word in _HUMPS.split(name)]
    stacked = r"\\".join(rf"{word}\vphantom{{Ag}}" for word in words)
    return words[0] if len(words) == 1 else rf"\shortstack[r]{{{stacked}}}"


def _line(cells: list[str]) -> str:
    return " & ".join(cells) + r" \\"


def _cell(entry: Entry, column: Column) -> str:
    text = _foldable(entry.text) if column.is_text else escaped(entry.text)
    if entry.best:
        text = rf"\textbf{{{text}}}"
    if change := entry.change_text:
        text += rf"{_CHANGES[change[0]]}{{{change[1:]}}}"
    if entry.signs:
        text += rf"\textsuperscript{{{escaped(entry.signs)}}}"
    return text


def _foldable(text: str) -> str:
    """Return text that may be broken within long names, too."""
    return escaped(_BREAKS.sub("\\g<0>\u200b", text))


def escaped(text: str) -> str:
    """Return a text as the format prints it; a dagger marks published rows."""
    marked = text.replace(PUBLISHED_MARK, DAGGER).replace(PUBLISHED_MARK.strip(), DAGGER)
    return "".join(_SPECIAL.get(sign, sign) for sign in marked)
