"""Holm's step-down correction for multiple tests."""

from __future__ import annotations

from collections.abc import Sequence


def holm(p_values: Sequence[float]) -> tuple[float, ...]:
    """Return adjusted p-values in the given order.

    Rejecting those of at most 0.05 keeps the probability of any false alarm at 0.05 or below,
    whatever the dependence between the tests.
    """
    if not p_values:
        return ()
    from statsmodels.stats.multitest import multipletests

    return tuple(map(float, multipletests(p_values, method="holm")[1]))
