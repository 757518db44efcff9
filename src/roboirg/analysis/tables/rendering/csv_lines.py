"""Tables for programs: comma-separated values, one line for each entry, or JSON."""

from __future__ import annotations

import json
from collections.abc import Sequence

from roboirg.analysis.tables.table import MARK_NAMES, Column, Entry, Row, Table
from roboirg.stats.cells import Counts
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
    "spared",
    "low_percent",
    "high_percent",
    "comparable",
    "differences",
)
"""The columns. Unknown values are empty; notes are left out."""

_ASCII = str.maketrans({"−": "-", "±": None})
"""For programs, which read −0.5 and ±0.0 as no numbers."""


def csv_text(*tables: Table) -> str:
    """Return tables as comma-separated lines, one for each entry, below the headings `HEAD`.

    A line has what is not printed, too: counts, and the interval of the rate.
    """
    lines: list[Sequence[object]] = [HEAD]
    for table in tables:
        for row in table.rows:
            for column, entry in zip(table.columns, row.entries, strict=True):
                lines.append(_line(table, row, column, entry))
    return csv_lines(lines)


def json_text(*tables: Table) -> str:
    """Return tables as JSON: a list with an object for each row, its texts by their headings.

    For example ``[{"table": "main", "setting": "explicit", "policy": "pi0", "mean": "62.5"}]``.
    """
    objects = []
    for table in tables:
        for row in table.rows:
            texts = list(table.labels(row))
            for entry in row.entries:
                texts.append(entry.text.translate(_ASCII))
            printed = dict(zip(table.headings, texts, strict=True))
            objects.append({"table": table.key, **printed})
    return json.dumps(objects, ensure_ascii=False, indent=1) + "\n"


def _line(table: Table, row: Row, column: Column, entry: Entry) -> list[object]:
    """Return the line of one entry of a table, with a value for each of the columns `HEAD`.

    Args:
        table: the entry's.
        row: the entry's; its group and name are values.
        column: the entry's; its name is a value.
        entry: with the rate in percent, its counts and its interval.
    """
    # Counts and interval take several columns each. None is written as nothing.
    counts: Sequence[int | None] = [None] * len(Counts._fields)
    if entry.counts is not None:
        counts = entry.counts
    ends: Sequence[str | None] = [None, None]
    if entry.interval is not None:
        ends = [f"{100 * end:.2f}" for end in entry.interval]
    is_comparable = None
    if entry.differences is not None:
        is_comparable = _flag(not entry.differences)
    return [
        table.key,
        row.source,
        row.group,
        row.name,
        column.name,
        _flag(bool(column.averages)),
        entry.percent,
        entry.word.translate(_ASCII),
        _flag(entry.applies),
        entry.change,
        _flag(entry.best),
        " ".join(MARK_NAMES[mark] for mark in entry.marks),
        *counts,
        *ends,
        is_comparable,
        "; ".join(entry.differences or ()),
    ]


def _flag(value: bool) -> str:
    return "yes" if value else "no"
