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


_ASCII = str.maketrans({"−": "-", "±": None})
"""For programs, which read −0.5 and ±0.0 as no numbers."""


def csv_text(*tables: Table) -> str:
    """Return every entry of some tables with its counts and the interval of its rate."""
    lines: list[Sequence[object]] = [HEAD]
    for table in tables:
        for row in table.rows:
            for column, entry in zip(table.columns, row.entries, strict=True):
                lines.append(_line(table, row, column, entry))
    return csv_lines(lines)


def json_text(*tables: Table) -> str:
    """Return a list with an object for each row: its table, and what is printed, by heading."""
    found = []
    for table in tables:
        for row in table.rows:
            entries = (entry.text.translate(_ASCII) for entry in row.entries)
            texts = (*table.labels(row), *entries)
            found.append({"table": table.key, **dict(zip(table.headings, texts, strict=True))})
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
        entry.word.translate(_ASCII),
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
