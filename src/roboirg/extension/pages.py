"""The paper's plans and rates, statistics, and tables in Markdown."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

from roboirg.evaluation.analysis.published import published_rows
from roboirg.evaluation.analysis.stats.intervals import without_spread
from roboirg.evaluation.analysis.stats.paired_tests import holm
from roboirg.evaluation.analysis.tables.rendering.markdown import markdown
from roboirg.evaluation.analysis.tables.table import Row, Table, named_columns
from roboirg.evaluation.plan.plan_file import read_plan_file

__all__ = ["holm", "markdown_table", "published_rows", "read_plan_file", "without_spread"]


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
    made = Table(
        key=title,
        title=title,
        heads=heads,
        columns=named_columns(*columns),
        rows=[Row(*row) for row in rows],
        notes=notes,
    )
    return markdown(made).rstrip("\n")
