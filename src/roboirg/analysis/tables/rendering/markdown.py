"""Tables in GitHub's Markdown."""

from __future__ import annotations

from collections.abc import Sequence

from roboirg.analysis.tables.table import Entry, Table

_SPECIAL = str.maketrans({sign: f"\\{sign}" for sign in "\\|*_`<[]"})


def markdown(table: Table) -> str:
    """Return a table in GitHub's Markdown, below its title and above its notes.

    Between headings and rows is a line such as ``| --- | ---: |``, whose colons align columns to
    the right. Only the first row of a group names the group.
    """
    rules = ["---"] * len(table.heads)
    for column in table.columns:
        rules.append("---" if column.is_text else "---:")
    headings = list(map(escaped, table.headings))
    lines = [f"### {escaped(table.title)}", "", _line(headings), _line(rules)]
    for line in table.lines():
        labels = map(escaped, line.labels)
        lines.append(_line([*labels, *map(_cell, line.row.entries)]))
    for note in table.notes:
        lines += ["", escaped(note)]
    return "\n".join(lines) + "\n"


def _line(cells: Sequence[str]) -> str:
    return f"| {' | '.join(cells)} |"


def _cell(entry: Entry) -> str:
    text = escaped(entry.text)
    if entry.best:
        text = f"**{text}**"
    parts = (text, entry.change_text, escaped(entry.signs))
    return " ".join(part for part in parts if part)


def escaped(text: str) -> str:
    """Return a text as the format prints it."""
    return text.translate(_SPECIAL)
