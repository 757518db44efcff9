"""Counts with their nouns, in the right number."""

from __future__ import annotations


def counted(count: int, noun: str, plural: str | None = None) -> str:
    """Return a count with its noun: ``1 episode``, ``2,550 episodes``, ``0 tries``.

    Args:
        count: the number.
        noun: the noun in the singular.
        plural: the plural, unless it is the singular with an ``s``.
    """
    word = noun if count == 1 else plural or f"{noun}s"
    return f"{count:,} {word}"
