"""Write the table of docs/performance.md anew from docs/bench.json.

python scripts/bench.py --out docs/bench.json && python scripts/write_bench_table.py
"""

from __future__ import annotations

from pathlib import Path

from benchmarks.results import markdown_table, read_figures
from written_parts import with_part

DOCS = Path(__file__).parent.parent / "docs"
PAGE = DOCS / "performance.md"


def page_text() -> str:
    """Return the page with the table of the newest figures."""
    table = markdown_table(read_figures(DOCS / "bench.json"))
    return with_part(PAGE.read_text(encoding="utf-8"), "bench", table.rstrip())


if __name__ == "__main__":
    PAGE.write_text(page_text(), encoding="utf-8")
