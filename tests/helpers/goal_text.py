"""Goals as a short text, in the notation of the sentences that people typed."""

from __future__ import annotations

from roboirg.core.episode import Goal


def goal_text(goal: Goal) -> str:
    """Return the values of a goal: ``red 2`` or, for counted colors, ``red 3 green 1``."""
    if "counts" in goal.as_mapping():
        return " ".join(f"{color} {count}" for color, count in goal.amounts)
    words: list[object] = []
    for value in goal.as_mapping().values():
        words += value if isinstance(value, tuple) else [value]
    return " ".join(map(str, words))
