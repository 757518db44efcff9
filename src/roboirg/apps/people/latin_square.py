"""Balanced Latin squares (Williams designs): who gets which condition when."""

from __future__ import annotations

import functools


@functools.cache
def balanced_square(conditions: int) -> tuple[tuple[int, ...], ...]:
    """Return the orders of conditions, one row per person.

    Every condition stands once in each row, and in every column equally often; over all rows, each
    condition directly follows each other one equally often. For an even number of conditions there
    are as many rows, for an odd one twice as many, of which the first half is a Latin square too.

    Args:
        conditions: how many there are, at least 1.
    """
    first = [0]
    low, high = 1, conditions - 1
    while low <= high:
        first.append(low)
        if low < high:
            first.append(high)
        low, high = low + 1, high - 1
    rows = [tuple((one + shift) % conditions for one in first) for shift in range(conditions)]
    if conditions % 2 and conditions > 1:
        rows += [row[::-1] for row in rows]
    return tuple(rows)
