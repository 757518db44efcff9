"""Tables in LaTeX; the document needs the package booktabs."""

from __future__ import annotations

import itertools

from roboirg.analysis.tables.table import NOT_APPLICABLE, Entry, Table

_ARROWS = {"up": r"$\uparrow$", "down": r"$\downarrow$", "same": r"$\rightarrow$"}
_SPECIAL = {
    "\\": r"\textbackslash{}",
    "~": r"\textasciitilde{}",
    "^": r"\textasciicircum{}",
    **{sign: f"\\{sign}" for sign in "&%$#_{}"},
    "–": "--",
    "…": r"\ldots{}",
    "−": "$-$",
    "±": r"$\pm$",
    "<": "$<$",
    "×": r"$\times$",
    "↑": r"$\uparrow$",
    "↓": r"$\downarrow$",
    "→": r"$\rightarrow$",
    "≠": r"$\neq$",
}


def latex(table: Table) -> str:
    """Return a table environment with rules between groups of columns and of rows."""
    columns = "ll" + "r" * len(table.columns)
    lines = [
        "% needs \\usepackage{booktabs}",
        r"\begin{table*}",
        r"\centering",
        rf"\caption{{{_escaped(table.title)}.}}",
        rf"\label{{tab:{table.key}}}",
        rf"\begin{{tabular}}{{{columns}}}",
        r"\toprule",
        *_column_groups(table),
        _line([*map(_escaped, table.heads), *(_escaped(column.name) for column in table.columns)]),
    ]
    for group, rows in table.groups().items():
        lines.append(r"\midrule")
        for number, row in enumerate(rows):
            name = "" if number else _escaped(group)
            lines.append(_line([name, _escaped(row.label), *map(_cell, row.entries)]))
    notes = rf"\par\smallskip{{\footnotesize {_escaped(' '.join(table.notes))}}}"
    lines += [r"\bottomrule", r"\end{tabular}", notes, r"\end{table*}"]
    return "\n".join(lines) + "\n"


def _column_groups(table: Table) -> list[str]:
    if not any(column.group for column in table.columns):
        return []
    cells, rules, place = ["", ""], [], len(table.heads) + 1
    for name, members in itertools.groupby(column.group for column in table.columns):
        width = len(list(members))
        cells.append(
            rf"\multicolumn{{{width}}}{{c}}{{{_escaped(name)}}}" if name else " & " * (width - 1)
        )
        if name:
            rules.append(rf"\cmidrule(lr){{{place}-{place + width - 1}}}")
        place += width
    return [_line(cells), "".join(rules)]


def _line(cells: list[str]) -> str:
    return " & ".join(cells) + r" \\"


def _cell(entry: Entry) -> str:
    text = "--" if entry.text == NOT_APPLICABLE else _escaped(entry.text)
    if entry.best:
        text = rf"\textbf{{{text}}}"
    if entry.change:
        text += rf"\,{_ARROWS[entry.change]}"
    if entry.signs:
        text += rf"\textsuperscript{{{_escaped(entry.signs)}}}"
    return text


def _escaped(text: str) -> str:
    return "".join(_SPECIAL.get(sign, sign) for sign in text)
