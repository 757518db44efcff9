"""Printing of tables for the terminal, Markdown, LaTeX and other programs."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import NamedTuple

from roboirg.analysis.tables.rendering.csv_lines import csv_text, json_text
from roboirg.analysis.tables.rendering.latex import latex
from roboirg.analysis.tables.rendering.markdown import markdown
from roboirg.analysis.tables.rendering.terminal import plain
from roboirg.core.errors import check_names


class Format(NamedTuple):
    """An output format.

    Attributes:
        suffix: of files in the format.
        draw: returns a table as text that ends in a newline; of a format for programs, several
            tables as one document.
        is_for_programs: whether its texts have no notes.
    """

    suffix: str
    draw: Callable[..., str]
    is_for_programs: bool = False


FORMATS: Mapping[str, Format] = {
    "terminal": Format(".txt", plain),
    "markdown": Format(".md", markdown),
    "latex": Format(".tex", latex),
    "csv": Format(".csv", csv_text, is_for_programs=True),
    "json": Format(".json", json_text, is_for_programs=True),
}


def get_format(name: str) -> Format:
    check_names("format", [name], FORMATS)
    return FORMATS[name]
