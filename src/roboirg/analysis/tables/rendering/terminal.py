"""Tables on the terminal; a table that is too wide is split into groups of columns."""

from __future__ import annotations

import io
from collections.abc import Sequence

from rich.console import Console, Group, RenderableType
from rich.table import Table as Grid
from rich.text import Text

from roboirg.analysis.stats.run_summary import ALL_TASKS
from roboirg.analysis.tables.table import Entry, Row, Table
from roboirg.analysis.tables.table_notes import ARROWS

PLAIN_WIDTH = 120
"""Characters in a line of a text file."""
_NARROWEST = 9
"""Characters of a rate with its arrow and mark."""
_BORDERS = 3
"""Characters of a line and two blanks."""


def renderable(table: Table, console: Console) -> RenderableType:
    """Return the table with its notes, split to fit the console's width."""
    parts = _parts(table, console.width)
    grids = [
        part
        for indices in parts
        for part in (
            Text(table.title if len(parts) == 1 else _title(table, indices), "bold"),
            _grid(table, indices),
        )
    ]
    return Group(*grids, *(Text(note, "dim") for note in table.notes))


def plain(table: Table) -> str:
    """Return the table as plain text of at most `PLAIN_WIDTH` characters a line."""
    console = Console(file=io.StringIO(), width=PLAIN_WIDTH, color_system=None)
    with console.capture() as captured:
        console.print(renderable(table, console))
    return "\n".join(line.rstrip() for line in captured.get().splitlines()) + "\n"


def _parts(table: Table, width: int) -> list[list[int]]:
    """Return the columns of each part: whole groups if they fit, at least one column."""
    heads = sum(
        max(map(len, (head, *words))) + _BORDERS
        for head, words in zip(
            table.heads, ([*table.groups()], [row.label for row in table.rows]), strict=True
        )
    )
    widths = [max(len(column.name), _NARROWEST) + _BORDERS for column in table.columns]
    parts: list[list[int]] = []
    room = 0
    for index, column in enumerate(table.columns):
        begins = index == 0 or column.group != table.columns[index - 1].group
        ahead = [at for at in range(index, len(widths)) if table.columns[at].group == column.group]
        needed = sum(widths[at] for at in ahead) if begins else widths[index]
        if not parts or needed > room:
            parts.append([])
            room = width - heads - 1
        parts[-1].append(index)
        room -= widths[index]
    return parts


def _title(table: Table, indices: Sequence[int]) -> str:
    groups = dict.fromkeys(table.columns[index].group or ALL_TASKS for index in indices)
    return f"{table.title}: {', '.join(groups)}"


def _grid(table: Table, indices: Sequence[int]) -> Grid:
    grid = Grid()
    for head in table.heads:
        grid.add_column(head, no_wrap=True)
    for index in indices:
        name = table.columns[index].name
        grid.add_column(name, justify="right", min_width=_NARROWEST, no_wrap=True)
    for group, rows in table.groups().items():
        grid.add_section()
        for number, row in enumerate(rows):
            cells = [_cell(row, row.entries[index]) for index in indices]
            grid.add_row(Text("" if number else group), Text(row.label, _style(row)), *cells)
    return grid


def _cell(row: Row, entry: Entry) -> Text:
    text = Text(entry.text, "bold" if entry.best else "")
    if entry.change:
        text.append(f" {ARROWS[entry.change]}")
    if entry.signs:
        text.append(f" {entry.signs}" if entry.text else entry.signs, "bold yellow")
    text.stylize(_style(row))
    return text


def _style(row: Row) -> str:
    return "" if row.source == "ours" else "dim"
