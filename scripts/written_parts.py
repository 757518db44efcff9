"""Parts of pages, from ``<!-- NAME -->`` to ``<!-- end of NAME -->``, and tables in Markdown."""

from __future__ import annotations

import re
from collections.abc import Collection, Iterable, Sequence


def with_part(page: str, name: str, text: str) -> str:
    """Return the page with another text as the part of a name.

    Raises:
        ValueError: the page has none.
    """
    begin = f"<!-- {name} -->"
    end = f"<!-- end of {name} -->"
    part = f"(?<={re.escape(begin)}\n\n).*?(?=\n\n{re.escape(end)})"
    written, found = re.subn(part, lambda _: text, page, count=1, flags=re.DOTALL)
    if not found:
        raise ValueError(f"The page has no part between {begin} and {end}.")
    return written


def table(
    heads: Sequence[object], rows: Iterable[Sequence[object]], numbers: Collection[object] = ()
) -> str:
    """Return a table in Markdown; columns with heads in `numbers` are aligned to the right."""
    rules = ["---:" if head in numbers else "---" for head in heads]
    lines = []
    for cells in [heads, rules, *rows]:
        lines.append(f"| {' | '.join(map(str, cells))} |")
    return "\n".join(lines)
