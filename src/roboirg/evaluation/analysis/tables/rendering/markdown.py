"""Tables in GitHub's Markdown."""

from __future__ import annotations

from roboirg.evaluation.analysis.tables.table import Entry, Table

_SPECIAL = str.maketrans({sign: f"\\{sign}" for sign in "\\|*_`<[]"})


def markdown(table: Table) -> str:
    """Return title, table and notes; only the first row of a group names the group."""
    sides = ["---" if column.is_text else "---:" for column in table.columns]
    lines = [f"### {escaped(table.title)}", "", _line([*map(escaped, table.headings)])]
    lines.append(_line(["---"] * len(table.heads) + sides))
    for _, labels, row in table.lines():
        lines.append(_line([*map(escaped, labels), *map(_cell, row.entries)]))
    notes = [line for note in table.notes for line in ("", escaped(note))]
    return "\n".join([*lines, *notes]) + "\n"


def _line(cells: list[str]) -> str:
    return f"| {' | '.join(cells)} |"


def _cell(entry: Entry) -> str:
    text = escaped(entry.text)
    text = f"**{text}**" if entry.best else text
    return " ".join(filter(None, (text, entry.change_text, escaped(entry.signs))))


def escaped(text: str) -> str:
    """Return a text as the format prints it."""
    return text.translate(_SPECIAL)
