"""Statistics, and tables in Markdown."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

from roboirg.analysis.tables.rendering.markdown import markdown
from roboirg.analysis.tables.table import Row, Table, named_columns
from roboirg.stats.intervals import ALPHA, interval_of_values

__all__ = [
    "ALPHA",
    "interval_of_values",
    "markdown_table",
]


def markdown_table(
    title: str,
    columns: Sequence[str],
    rows: Iterable[tuple[str, str, Sequence[str]]],
    notes: Sequence[str] = (),
    heads: tuple[str, ...] = ("row",),
) -> str:
    """Return a table of texts in Markdown, as the benchmark prints its own.

    Args:
        title: above it.
        columns: heads of the texts.
        rows: group, name in the group, and a text for each column; of rows with the same group
            only the first shows it.
        notes: below it.
        heads: headings of the groups and of the names; a single one is of the names.
    """
    table = Table(
        key=title,
        title=title,
        heads=heads,
        columns=named_columns(*columns),
        rows=[Row(*row) for row in rows],
        notes=notes,
    )
    return markdown(table).rstrip("\n")
