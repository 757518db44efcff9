"""Parameters of which a few are tested fast and the others are slow."""

from collections.abc import Collection, Iterable

import pytest


def slow_but(fast: Collection[object], values: Iterable[object]) -> list[object]:
    """Return the values, marked as slow but for some of them, which must be among the values.

    A tuple has values of several parameters.
    """
    values = list(values)
    assert all(one in values for one in fast), fast
    return [one if one in fast else _slow(one) for one in values]


def _slow(one: object) -> object:
    return pytest.param(*(one if isinstance(one, tuple) else (one,)), marks=pytest.mark.slow)
