"""Write the table of docs/performance.md anew from docs/bench.json.

python scripts/bench.py --out docs/bench.json && python scripts/write_bench_table.py
"""

from __future__ import annotations

import re
from pathlib import Path

from benchmarks.results import markdown_table, read_figures

DOCS = Path(__file__).parent.parent / "docs"
PAGE = DOCS / "performance.md"
TABLE = re.compile(r"(?<=<!-- bench -->\n\n).*?(?=\n<!-- end of bench -->)", re.DOTALL)


def page_text() -> str:
    """Return the page with the table of the newest figures."""
    table = markdown_table(read_figures(DOCS / "bench.json"))
    return TABLE.sub(lambda _: table, PAGE.read_text(encoding="utf-8"), count=1)


if __name__ == "__main__":
    PAGE.write_text(page_text(), encoding="utf-8")
