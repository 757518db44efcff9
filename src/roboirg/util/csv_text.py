"""Rows as the text of a CSV file."""

from __future__ import annotations

import csv
import io
import re
from collections.abc import Iterable, Mapping

_FORMULA = re.compile(
    r"(?![+-]?[\d.,]+%?"
    r"(?: to [+-]?[\d.,]+%?| \([+-]?[\d.,]+%? to [+-]?[\d.,]+%?\)| \([a-z ]+\))?\Z)"
    r"[=@\t\r+-]"
)
"""How a text begins that spreadsheets compute; a signed number is none, alone, with its interval
or with words in brackets."""


def csv_text(rows: Iterable[Mapping[str, object]]) -> str:
    """Return rows of the same columns as CSV, with a line of names first; empty without any row.

    ``[{"task": "BinFill", "episodes": 2}]`` -> the lines ``task,episodes`` and ``BinFill,2``.
    """
    table = list(rows)
    if not table:
        return ""
    head = table[0].keys()
    return csv_lines([head, *(row.values() for row in table)])


def csv_lines(rows: Iterable[Iterable[object]]) -> str:
    """Return rows as lines of CSV.

    A text that a spreadsheet would compute, such as ``=1+1``, gets an apostrophe in front.
    """
    out = io.StringIO()
    writer = csv.writer(out, lineterminator="\n")
    for row in rows:
        writer.writerow([_cell(value) for value in row])
    return out.getvalue()


def _cell(value: object) -> object:
    """Return a value; a text that spreadsheets would compute begins with an apostrophe."""
    if isinstance(value, str) and _FORMULA.match(value):
        return f"'{value}"
    return value
