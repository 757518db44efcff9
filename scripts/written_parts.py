"""Parts of pages that scripts write, between ``<!-- NAME -->`` and ``<!-- end of NAME -->``."""

from __future__ import annotations

import re


def written_part(page: str, name: str) -> str:
    """Return the part of a page with a name.

    Raises:
        ValueError: the page has none.
    """
    found = _place(name).search(page)
    if found is None:
        raise ValueError(
            f"The page has no part between <!-- {name} --> and <!-- end of {name} -->."
        )
    return found[0]


def with_part(page: str, name: str, text: str) -> str:
    """Return the page with another text as that part.

    Raises:
        ValueError: the page has none.
    """
    written_part(page, name)
    return _place(name).sub(lambda _: text, page, count=1)


def _place(name: str) -> re.Pattern[str]:
    begin, end = f"<!-- {name} -->\n\n", f"\n\n<!-- end of {name} -->"
    return re.compile(f"(?<={re.escape(begin)}).*?(?={re.escape(end)})", re.DOTALL)
