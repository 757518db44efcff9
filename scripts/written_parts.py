"""Parts of pages; a part is between ``<!-- NAME -->`` and ``<!-- end of NAME -->``."""

from __future__ import annotations

import re


def with_part(page: str, name: str, text: str) -> str:
    """Return the page with another text as the part of a name.

    Raises:
        ValueError: the page has none.
    """
    begin, end = f"<!-- {name} -->", f"<!-- end of {name} -->"
    part = f"(?<={re.escape(begin)}\n\n).*?(?=\n\n{re.escape(end)})"
    written, found = re.subn(part, lambda _: text, page, count=1, flags=re.DOTALL)
    if not found:
        raise ValueError(f"The page has no part between {begin} and {end}.")
    return written
