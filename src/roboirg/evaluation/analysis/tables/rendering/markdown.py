"""Tables in GitHub's Markdown."""

from __future__ import annotations

from roboirg.evaluation.analysis.tables.table import Entry, Table

_SPECIAL = str.maketrans({sign: f"\\{sign}" for sign in "\\|*_`<[]"})


def markdown(table: Table) -> str:
    """Return title, table and notes; only the first row of a group names the group."""
    heads = [*table.heads, *(column.name for column in table.columns)]
    lines = [f"### {_escaped(table.title)}", "", _line([_escaped(head) for head in heads])]
    lines.append(_line(["---"] * len(table.heads) + ["---:"] * len(table.columns)))
    for group, rows in table.groups().items():
        for number, row in enumerate(rows):
            name = "" if number else _escaped(group)
            names = map(_escaped, table.names(row))
            lines.append(_line([name, *names, *map(_cell, row.entries)]))
    notes = [line for note in table.notes for line in ("", _escaped(note))]
    return "\n".join([*lines, *notes]) + "\n"


def _line(cells: list[str]) -> str:
    return f"| {' | '.join(cells)} |"


def _cell(entry: Entry) -> str:
    text = f"**{entry.text}**" if entry.best else entry.text
    return " ".join(filter(None, (text, entry.change_text, _escaped(entry.signs))))


def _escaped(text: str) -> str:
    return text.translate(_SPECIAL)
