"""Many tests at once: Holm's step-down correction."""

from __future__ import annotations

from collections.abc import Sequence


def holm(p_values: Sequence[float]) -> tuple[float, ...]:
    """Adjusted p-values, in the order given: reject what is at most 0.05.

    The chance of any false alarm among all of them is then at most 0.05, however the tests depend
    on each other. None for none.
    """
    if not p_values:
        return ()
    from statsmodels.stats.multitest import multipletests

    return tuple(map(float, multipletests(p_values, method="holm")[1]))
