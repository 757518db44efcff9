"""Split a wide table into parts that fit, each with some of its columns."""

from __future__ import annotations

from collections.abc import Sequence

BORDERS = 3
"""Characters of a column's line and its two blanks, in text."""


def split_columns(groups: Sequence[str], widths: Sequence[float], room: float) -> list[list[int]]:
    """Return the columns of each part: whole groups if they fit, at least one column.

    Args:
        groups: of the columns; columns of a group stand side by side.
        widths: of the columns.
        room: width of a part without its row labels, in the same unit.
    """
    parts: list[list[int]] = []
    left = 0.0
    for index, group in enumerate(groups):
        begins = index == 0 or group != groups[index - 1]
        ahead = [at for at in range(index, len(widths)) if groups[at] == group]
        needed = sum(widths[at] for at in ahead) if begins else widths[index]
        if not parts or needed > left:
            parts.append([])
            left = room
        parts[-1].append(index)
        left -= widths[index]
    return parts
