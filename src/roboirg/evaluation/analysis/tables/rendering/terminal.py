"""Tables on the terminal; a table that is too wide is split into groups of columns."""

from __future__ import annotations

import io
from collections.abc import Sequence

from rich.console import Console, Group, RenderableType
from rich.table import Table as Grid
from rich.text import Text

from roboirg.evaluation.analysis.stats.run_summary import ALL_TASKS
from roboirg.evaluation.analysis.tables.rendering.column_parts import BORDERS, split_columns
from roboirg.evaluation.analysis.tables.table import Entry, Row, Table
from roboirg.util.console_width import LINE_WIDTH, line_width, widen

_TEXT_WIDTH = 80
"""Characters of a column of texts, which are folded."""


def renderable(table: Table, console: Console) -> RenderableType:
    """Return the table with its notes, split to fit the console's width.

    A console that is no terminal is widened if names need it; in a terminal they are folded.
    """
    parts = _parts(table, line_width(console))
    grids = [_grid(table, indices) for indices in parts]
    widen(console, *grids)
    titles = (
        Text(table.title if len(parts) == 1 else _title(table, indices), "bold")
        for indices in parts
    )
    titled = (part for pair in zip(titles, grids, strict=True) for part in pair)
    return Group(*titled, *(Text(note, "dim") for note in table.notes))


def plain(table: Table) -> str:
    """Return the table as plain text, in lines of 120 characters unless names need more."""
    console = Console(file=io.StringIO(), width=LINE_WIDTH, color_system=None)
    with console.capture() as captured:
        console.print(renderable(table, console))
    return "\n".join(line.rstrip() for line in captured.get().splitlines()) + "\n"


def _parts(table: Table, width: int) -> list[list[int]]:
    """Return the columns of each part; those without a result in any row are left out."""
    labels = [(group, *table.names(row)) for group, rows in table.groups().items() for row in rows]
    heads = sum(max(map(len, words)) + BORDERS for words in zip(table.heads, *labels, strict=True))
    widths = {
        index: max(len(column.name), *(len(_cell(row, row.entries[index])) for row in table.rows))
        + BORDERS
        for index, column in enumerate(table.columns)
        if any(entry.percent is not None or entry.word or entry.signs
               for entry in (row.entries[index] for row in table.rows))
    }  # fmt: skip
    groups, shown = [table.columns[index].group for index in widths], list(widths)
    parts = split_columns(groups, list(widths.values()), width - heads - 1)
    return [[shown[place] for place in part] for part in parts]


def _title(table: Table, indices: Sequence[int]) -> str:
    groups = dict.fromkeys(table.columns[index].group or ALL_TASKS for index in indices)
    return f"{table.title}: {', '.join(groups)}"


def _grid(table: Table, indices: Sequence[int]) -> Grid:
    grid = Grid()
    for head in table.heads:
        grid.add_column(head, overflow="fold")
    for index in indices:
        column = table.columns[index]
        if column.is_text:
            grid.add_column(column.name, overflow="fold", max_width=_TEXT_WIDTH)
        else:
            grid.add_column(column.name, justify="right", no_wrap=True)
    for group, rows in table.groups().items():
        grid.add_section()
        for number, row in enumerate(rows):
            cells = [_cell(row, row.entries[index]) for index in indices]
            names = (Text(name, _style(row)) for name in table.names(row))
            grid.add_row(Text("" if number else group), *names, *cells)
    return grid


def _cell(row: Row, entry: Entry) -> Text:
    text = Text(entry.text, "bold" if entry.best else "")
    if entry.change is not None:
        text.append(f" {entry.change_text}")
    if entry.signs:
        text.append(f" {entry.signs}" if entry.text else entry.signs, "bold yellow")
    text.stylize(_style(row))
    return text


def _style(row: Row) -> str:
    return "" if row.source == "ours" else "dim"
