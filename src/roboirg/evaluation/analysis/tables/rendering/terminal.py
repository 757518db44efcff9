"""Tables on the terminal; a table that is too wide is split into groups of columns."""

from __future__ import annotations

import io
from collections.abc import Iterable, Sequence

from rich.console import Console, Group, RenderableType
from rich.table import Table as Grid
from rich.text import Text

from roboirg.evaluation.analysis.stats.measure import ALL_TASKS
from roboirg.evaluation.analysis.tables.table import Entry, Table
from roboirg.util.console_width import LINE_WIDTH, line_width, widen

_BORDERS = 3
"""Characters of a column's line and its two blanks."""
_TEXT_WIDTH = 80
"""Characters of a column of texts, which are folded."""


def renderable(table: Table, console: Console) -> RenderableType:
    """Return the table with its notes, split to fit the console's width.

    Columns without a result in any row are left out. A console that is no terminal is widened if
    names need it; in a terminal they are folded.
    """
    columns = enumerate(zip(*(row.entries for row in table.rows), strict=True))
    shown = [index for index, found in columns if any(one.applies and str(one) for one in found)]
    labels = zip(table.heads, *map(table.labels, table.rows), strict=True)
    names = 1 + sum(max(map(len, words)) + _BORDERS for words in labels)
    parts = split_columns(table, shown, line_width(console) - names)
    grids = [_grid(table, indices) for indices in parts]
    widen(console, *grids)
    lines: list[RenderableType] = []
    for title, grid in zip(_titles(table, parts), grids, strict=True):
        lines += [Text(title, "bold"), grid]
    return Group(*lines, *(Text(note, "dim") for note in table.notes))


def print_tables(tables: Iterable[Table], console: Console) -> None:
    for table in tables:
        console.print(renderable(table, console), highlight=False)


def plain(table: Table) -> str:
    """Return the table as plain text, in lines of 120 characters unless names need more."""
    console = Console(file=io.StringIO(), width=LINE_WIDTH, color_system=None)
    with console.capture() as captured:
        console.print(renderable(table, console))
    return "\n".join(line.rstrip() for line in captured.get().splitlines()) + "\n"


def split_columns(table: Table, shown: Sequence[int], room: int) -> list[list[int]]:
    """Return the columns of each part: whole groups if they fit, at least one column.

    Args:
        table: what is split.
        shown: the columns that are printed.
        room: characters of a part without the labels of its rows.
    """
    names = [[column.name] for column in table.columns]
    texts = zip(names, *(map(str, row.entries) for row in table.rows), strict=True)
    widths = [max(map(len, (*name, *words))) + _BORDERS for name, *words in texts]
    parts: list[list[int]] = []
    left = 0
    for index in shown:
        group = [at for at in shown if table.columns[at].group == table.columns[index].group]
        # A group stays together; one that is too wide for a part begins with one of its own.
        needed = sum(widths[at] for at in group) if index == group[0] else widths[index]
        if not parts or needed > left:
            parts.append([])
            left = room
        parts[-1].append(index)
        left -= widths[index]
    return parts


def _titles(table: Table, parts: Sequence[Sequence[int]]) -> list[str]:
    if len(parts) == 1:
        return [table.title]
    if not any(column.group for column in table.columns):
        return [f"{table.title} ({number} of {len(parts)})" for number, _ in enumerate(parts, 1)]
    groups = [dict.fromkeys(table.columns[at].group or ALL_TASKS for at in part) for part in parts]
    return [f"{table.title}: {', '.join(one)}" for one in groups]


def _grid(table: Table, indices: Sequence[int]) -> Grid:
    grid = Grid()
    for head in table.heads:
        grid.add_column(head, overflow="fold")
    for column in (table.columns[index] for index in indices):
        grid.add_column(
            column.name,
            justify="left" if column.is_text else "right",
            no_wrap=not column.is_text,
            overflow="fold",
            max_width=_TEXT_WIDTH,
        )
    for begins, labels, row in table.lines():
        if begins:
            grid.add_section()
        cells = (_cell(row.entries[index]) for index in indices)
        grid.add_row(*map(Text, labels), *cells, style="" if row.source == "ours" else "dim")
    return grid


def _cell(entry: Entry) -> Text:
    texts = (entry.text, entry.change_text, entry.signs)
    styles = ("bold" if entry.best else entry.style, "", "bold yellow")
    parts = zip(texts, styles, strict=True)
    return Text(" ").join(Text(text, style) for text, style in parts if text)
