"""Tables in LaTeX; the document needs the packages booktabs, xcolor and amssymb.

A table is as wide as both columns of IEEEtran's conference class, or, in pieces, no wider than the
text of a one-column article. What is wider or longer becomes several tables: by groups of columns,
as on the terminal, and by groups of rows.
"""

from __future__ import annotations

import dataclasses
import itertools
from collections.abc import Iterator, Sequence

from roboirg.evaluation.analysis.tables.rendering.latex_layout import (
    HUMPS,
    PAGE,
    Layout,
    Part,
    parts_of,
)
from roboirg.evaluation.analysis.tables.table import (
    CHECK_MARK,
    NOT_APPLICABLE,
    PUBLISHED_MARK,
    Column,
    Entry,
    Table,
)

_PREAMBLE = r"""% needs \usepackage{booktabs,xcolor,amssymb}
\providecommand{\roboirgup}[1]{{\tiny\textcolor[rgb]{0,.42,.25}{$\uparrow$#1}}}
\providecommand{\roboirgdown}[1]{{\tiny\textcolor[rgb]{.75,.1,.1}{$\downarrow$#1}}}
\providecommand{\roboirgsame}[1]{{\tiny\textcolor[gray]{.4}{$\rightarrow$#1}}}"""
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
}
_BREAKS = frozenset("./:_-,=?&")
"""Signs behind which a long name may be broken."""
_MOST_LETTERS = 14
"""Letters of a name behind which it may be broken in any case."""


def latex(table: Table, layout: Layout = PAGE) -> str:
    """Return table environments with rules between groups of columns and of rows."""
    mark = PUBLISHED_MARK.strip()
    notes = tuple(note.replace(mark, DAGGER) for note in table.notes)
    table = dataclasses.replace(table, published_mark=DAGGER, notes=notes)
    lines = [_PREAMBLE]
    parts = parts_of(table, layout)
    for number, part in enumerate(parts, start=1):
        lines += _float(table, part, layout, number, len(parts))
    return "\n".join(lines) + "\n"


def _float(table: Table, part: Part, layout: Layout, number: int, count: int) -> Iterator[str]:
    columns = [table.columns[index] for index in part.indices]
    heads = table.heads[1:]
    caption, label = escaped(table.title), f"tab:{table.key}"
    if count > 1:
        caption += f" ({number} of {count})"
        label += f"-{number}" if number > 1 else ""
    first = rf"p{{{part.names_pt:.0f}pt}}" if len(heads) == 1 else "c" * len(heads)
    yield r"\begin{table*}"
    yield rf"\centering\{layout.size}"
    yield rf"\setlength{{\tabcolsep}}{{{layout.gap / 2:.0f}pt}}"
    yield rf"\caption{{{caption}.}}"
    yield rf"\label{{{label}}}"
    yield rf"\begin{{tabular}}{{{first}{'r' * len(columns)}}}"
    yield r"\toprule"
    yield from _column_groups(columns, len(heads))
    yield _line([*map(escaped, heads), *(_head(column.name) for column in columns)])
    block = dataclasses.replace(table, rows=tuple(part.rows))
    for group, rows in block.groups().items():
        yield r"\midrule"
        width = len(heads) + len(columns)
        yield rf"\multicolumn{{{width}}}{{l}}{{\emph{{{escaped(group)}}}}} \\"
        for row in rows:
            cells = [_cell(row.entries[index]) for index in part.indices]
            yield _line([*_names(table.names(row)), *cells])
    yield r"\bottomrule"
    yield r"\end{tabular}"
    if number == count:
        yield rf"\par\smallskip{{\raggedright {_foldable(' '.join(table.notes))}\par}}"
    yield r"\end{table*}"


def _names(labels: Sequence[str]) -> list[str]:
    if len(labels) > 1:
        return [escaped(label) for label in labels]
    return [rf"\raggedright {_foldable(labels[0])}"]


def _column_groups(columns: Sequence[Column], names: int) -> list[str]:
    if not any(column.group for column in columns):
        return []
    cells, rules, place = [""] * names, [], names + 1
    for name, members in itertools.groupby(column.group for column in columns):
        width = len(list(members))
        cells.append(
            rf"\multicolumn{{{width}}}{{c}}{{{escaped(name)}}}" if name else " & " * (width - 1)
        )
        if name:
            rules.append(rf"\cmidrule(lr){{{place}-{place + width - 1}}}")
        place += width
    return [_line(cells), "".join(rules)]


def _head(name: str) -> str:
    """Return a heading with a line for each of its words."""
    words = [escaped(word) for word in HUMPS.split(name)]
    stacked = r"\\".join(rf"{word}\vphantom{{Ag}}" for word in words)
    return words[0] if len(words) == 1 else rf"\shortstack[r]{{{stacked}}}"


def _line(cells: list[str]) -> str:
    return " & ".join(cells) + r" \\"


def _cell(entry: Entry) -> str:
    text = "--" if entry.text == NOT_APPLICABLE else escaped(entry.text)
    if entry.best:
        text = rf"\textbf{{{text}}}"
    if change := entry.change_text:
        text += rf"{_CHANGES[change[0]]}{{{change[1:]}}}"
    if entry.signs:
        text += rf"\textsuperscript{{{escaped(entry.signs)}}}"
    return text


def _foldable(text: str) -> str:
    """Return text that may be broken within long names, too."""
    found, run = [], 0
    for sign in text:
        run = 0 if sign in _BREAKS or sign == " " else run + 1
        may_break = sign in _BREAKS or run == _MOST_LETTERS
        found.append(escaped(sign) + (r"\allowbreak{}" if may_break else ""))
        run = 0 if may_break else run
    return "".join(found)


def escaped(text: str) -> str:
    """Return a text as the format prints it."""
    return "".join(_SPECIAL.get(sign, sign) for sign in text)
