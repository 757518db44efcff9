"""Tables on the terminal; a table that is too wide is split into groups of columns."""

from __future__ import annotations

import io
from collections import defaultdict
from collections.abc import Iterable, Sequence

from rich.console import Console, Group, RenderableType
from rich.table import Table as Grid
from rich.text import Text

from roboirg.analysis.measures.measure import ALL_TASKS
from roboirg.analysis.tables.table import Entry, Table
from roboirg.util.console_width import LINE_WIDTH, line_width, widen

_BORDERS = 3
"""Characters of a column's line and its two blanks."""
_TEXT_WIDTH = 80
"""Characters of a column of texts, which are folded."""


def renderable(table: Table, console: Console) -> RenderableType:
    """Return a table as the terminal prints it: title, grid and notes, several if it is too wide.

    Columns without a result in any row are left out. If the output is a file, its lines are made as
    long as names need; in a terminal these are folded.
    """
    room = line_width(console) - _labels_width(table)
    parts = split_columns(table, _columns_with_text(table), room)
    grids = [_grid(table, part) for part in parts]
    widen(console, *grids)
    lines: list[RenderableType] = []
    for title, grid in zip(_titles(table, parts), grids, strict=True):
        lines += [Text(title, "bold"), grid]
    for note in table.notes:
        lines.append(Text(note, "dim"))
    return Group(*lines)


def _columns_with_text(table: Table) -> list[int]:
    """Return the numbers of the columns in which some row has a result."""
    shown = set()
    for row in table.rows:
        for number, entry in enumerate(row.entries):
            if entry.applies and str(entry):
                shown.add(number)
    return sorted(shown)


def _labels_width(table: Table) -> int:
    """Return how many characters the labels of the rows take, with the lines between them."""
    width = 1  # the line before the first
    for texts in zip(table.heads, *map(table.labels, table.rows), strict=True):
        width += max(map(len, texts)) + _BORDERS
    return width


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
    """Divide the columns of a table that is too wide into parts that fit.

    For example ``[[0, 1, 2], [3, 4]]`` for five columns, of which three fit. A group of columns,
    such as a suite of tasks, stays together if it fits into one part.

    Args:
        table: what is split.
        shown: numbers of the columns that are printed.
        room: width of a part in characters, without the labels of its rows.

    Returns:
        The numbers of the columns of each part, at least one.
    """
    widths = _column_widths(table)
    groups = defaultdict(list)
    for number in shown:
        groups[table.columns[number].group].append(number)
    parts: list[list[int]] = []
    left = 0  # characters that are free in the last part
    for number in shown:
        width_to_fit = widths[number]
        group = groups[table.columns[number].group]
        if number == group[0]:
            # A group stays together; one that is too wide for a part begins with one of its own.
            width_to_fit = sum(widths[member] for member in group)
        if not parts or width_to_fit > left:
            parts.append([])
            left = room
        parts[-1].append(number)
        left -= widths[number]
    return parts


def _column_widths(table: Table) -> list[int]:
    """Return the width of each column in characters, with its line and blanks."""
    widths = [len(column.name) for column in table.columns]
    for row in table.rows:
        for number, entry in enumerate(row.entries):
            widths[number] = max(widths[number], len(str(entry)))
    return [width + _BORDERS for width in widths]


def _titles(table: Table, parts: Sequence[Sequence[int]]) -> list[str]:
    """Return the title of each part, such as ``Success: counting`` or ``Success (1 of 2)``.

    Parts are called by their groups of columns; without groups they are numbered.
    """
    if len(parts) == 1:
        return [table.title]
    has_groups = any(column.group for column in table.columns)
    titles = []
    for number, part in enumerate(parts, 1):
        if has_groups:
            # The column without a group is the overall average.
            groups = dict.fromkeys(table.columns[column].group or ALL_TASKS for column in part)
            titles.append(f"{table.title}: {', '.join(groups)}")
        else:
            titles.append(f"{table.title} ({number} of {len(parts)})")
    return titles


def _grid(table: Table, numbers: Sequence[int]) -> Grid:
    """Return some columns of a table, given their numbers, as the library rich prints them.

    Rows that are not this run's, such as published ones, are dim.
    """
    grid = Grid()
    for head in table.heads:
        grid.add_column(head, overflow="fold")
    for number in numbers:
        column = table.columns[number]
        grid.add_column(
            column.name,
            justify="left" if column.is_text else "right",
            no_wrap=not column.is_text,
            overflow="fold",
            max_width=_TEXT_WIDTH,
        )
    for line in table.lines():
        if line.begins_group:
            grid.add_section()
        entries = line.row.entries
        cells = [_cell(entries[number]) for number in numbers]
        style = "" if line.row.source == "ours" else "dim"
        grid.add_row(*map(Text, line.labels), *cells, style=style)
    return grid


def _cell(entry: Entry) -> Text:
    """Return an entry as the terminal prints it: the rate, bold if the best, change, and signs.

    The change is from a reference, such as explicit; signs, in yellow, mark incomplete rates.
    """
    parts = []
    if entry.text:
        parts.append(Text(entry.text, "bold" if entry.best else entry.style))
    if entry.change_text:
        parts.append(Text(entry.change_text))
    if entry.signs:
        parts.append(Text(entry.signs, "bold yellow"))
    return Text(" ").join(parts)
