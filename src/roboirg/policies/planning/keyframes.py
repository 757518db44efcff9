"""MemER's memory: frames that a model chose to keep, near ones merged into one."""

from __future__ import annotations

from collections.abc import Iterable

NEAR = 8
"""Control steps between neighbors of one group (MME-VLA; a comment of theirs says 10)."""


def merged(steps: Iterable[int], near: int = NEAR) -> tuple[int, ...]:
    """One step for each group of near ones: the middle one, of two the later.

    Args:
        steps: at which frames were taken; in any order, repeated or not.
        near: the most by which neighbors of a group are apart.

    Returns:
        In order of time, each of them one of `steps`.
    """
    groups: list[list[int]] = []
    for step in sorted(set(steps)):
        if groups and step - groups[-1][-1] <= near:
            groups[-1].append(step)
        else:
            groups.append([step])
    return tuple(group[len(group) // 2] for group in groups)
