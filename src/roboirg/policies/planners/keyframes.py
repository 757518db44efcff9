"""MemER's memory: key frames chosen by a model, of which near ones are merged."""

from __future__ import annotations

from collections.abc import Iterable

MAX_GAP = 8
"""Largest gap between neighbors of a group, control steps (MME-VLA; a comment there says 10)."""


def merge_keyframes(steps: Iterable[int], near: int = MAX_GAP) -> tuple[int, ...]:
    """Replace each group of near steps by its middle one, of two the later.

    Args:
        steps: of the frames, in any order, possibly repeated.
        near: largest gap between neighbors of a group.

    Returns:
        Some of `steps`, ascending.
    """
    groups: list[list[int]] = []
    for step in sorted(set(steps)):
        if groups and step - groups[-1][-1] <= near:
            groups[-1].append(step)
        else:
            groups.append([step])
    return tuple(group[len(group) // 2] for group in groups)
