"""Write the table of the columns of results into docs/own-tables.md.

python scripts/write_column_table.py
"""

from __future__ import annotations

from pathlib import Path

from written_parts import with_part

from roboirg.evaluation.analysis.results.frame import COLUMNS
from roboirg.evaluation.analysis.results.reading import WORD_COLUMNS

PAGE = Path(__file__).parent.parent / "docs" / "own-tables.md"


def page_text() -> str:
    """Return the page with the columns that are declared now."""
    lines = ["| column | kind | meaning | missing |", "| --- | --- | --- | --- |"]
    lines += [
        f"| `{one.name}` | {one.kind} | {one.meaning} | {one.missing or 'never'} |"
        for one in (*COLUMNS.values(), *WORD_COLUMNS.values())
    ]
    return with_part(PAGE.read_text(encoding="utf-8"), "columns", "\n".join(lines))


if __name__ == "__main__":
    PAGE.write_text(page_text(), encoding="utf-8")
