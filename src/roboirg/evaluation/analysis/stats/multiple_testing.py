"""Holm's step-down correction for multiple tests."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np


def holm(p_values: Sequence[float]) -> tuple[float, ...]:
    """Return adjusted p-values in the given order.

    Rejecting those of at most 0.05 keeps the probability of any false alarm at 0.05 or below,
    whatever the dependence between the tests.
    """
    # Statsmodels has this too, but collects garbage in every call, which visits all records.
    values = np.asarray(p_values, dtype=np.float64)
    order = np.argsort(values)
    adjusted = np.empty_like(values)
    adjusted[order] = np.maximum.accumulate(values[order] * np.arange(len(values), 0, -1))
    return tuple(np.minimum(adjusted, 1.0).tolist())
