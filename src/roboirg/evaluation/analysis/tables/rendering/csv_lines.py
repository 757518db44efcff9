"""Tables for programs: comma-separated values, one line for each entry, or JSON."""

from __future__ import annotations

import json
from collections.abc import Sequence

from roboirg.evaluation.analysis.tables.table import (
    ERROR_MARK,
    MISSING_MARK,
    PARTIAL_MARK,
    Column,
    Entry,
    Row,
    Table,
)
from roboirg.util.csv_text import csv_lines

HEAD = (
    "table",
    "source",
    "group",
    "name",
    "column",
    "is_average",
    "percent",
    "word",
    "applies",
    "change",
    "best",
    "incomplete",
    "successes",
    "trials",
    "episodes",
    "errors",
    "missing",
    "low_percent",
    "high_percent",
    "comparable",
    "differences",
)
"""The columns. Unknown values are empty; notes are left out."""

_MARK_NAMES = {ERROR_MARK: "errors", MISSING_MARK: "missing", PARTIAL_MARK: "partial"}


def csv_text(table: Table) -> str:
    """Return every entry of a table with its counts and the interval of its rate."""
    lines: list[Sequence[object]] = [HEAD]
    for row in table.rows:
        for column, entry in zip(table.columns, row.entries, strict=True):
            lines.append(_line(table, row, column, entry))
    return csv_lines(lines)


def json_text(table: Table) -> str:
    """Return a list with an object for each row: what is printed, by heading."""
    rows = [(*table.labels(row), *(entry.text for entry in row.entries)) for row in table.rows]
    found = [dict(zip(table.headings, row, strict=True)) for row in rows]
    return json.dumps(found, ensure_ascii=False, indent=1) + "\n"


def _line(table: Table, row: Row, column: Column, entry: Entry) -> list[object]:
    ends = ["", ""] if entry.interval is None else [f"{100 * end:.2f}" for end in entry.interval]
    return [
        table.key,
        row.source,
        row.group,
        row.name,
        column.name,
        _flag(bool(column.averages)),
        "" if entry.percent is None else entry.percent,
        entry.word,
        _flag(entry.applies),
        "" if entry.change is None else entry.change,
        _flag(entry.best),
        " ".join(_MARK_NAMES[mark] for mark in entry.marks),
        *(entry.counts or ("",) * 5),
        *ends,
        "" if entry.differences is None else _flag(not entry.differences),
        "; ".join(entry.differences or ()),
    ]


def _flag(value: bool) -> str:
    return "yes" if value else "no"
