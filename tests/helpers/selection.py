"""Parameters of which a few are tested fast and the others are slow."""

from collections.abc import Collection, Iterable

import pytest


def slow_but(fast: Collection[object], values: Iterable[object]) -> list[object]:
    """Return the values, marked as slow but for some of them, which must be among the values.

    A tuple has values of several parameters.
    """
    values = list(values)
    assert all(value in values for value in fast), fast
    return [value if value in fast else _slow(value) for value in values]


def _slow(value: object) -> object:
    values = value if isinstance(value, tuple) else (value,)
    return pytest.param(*values, marks=pytest.mark.slow)
