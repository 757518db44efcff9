"""Wilson's interval of a rate, and the bootstrap over episodes behind all other intervals.

Results of several policy seeds in the same episode are correlated: an episode that is hard for one
seed is hard for the next. So the bootstrap resamples episodes, not trials.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from roboirg.core.extras import extra_needed

Z_95 = 1.959963984540054
"""Two-sided 95 % quantile of the normal distribution."""
ALPHA = 0.05
"""Share of intervals that may miss the true value, and of tests that may raise a false alarm."""
SEED = 20_240_607
"""Of all bootstraps that are shown; the same records give the same numbers."""
DRAWS = 4000
"""Bootstrap resamples; the ends of an interval then vary by about 3 % of its length."""
TOO_FEW = "too few episodes"
"""Printed in place of an interval: it takes more episodes than tasks."""
_ROUNDING = 1e-9
"""Ends of an interval that are closer are equal."""

Rows = NDArray[np.int64]
"""A row for each episode with k pairs of successes and trials, shape (episodes, 2 k)."""


Draws = NDArray[np.float64]
"""A rate, a gap or several for each resample, shape (draws,) or (draws, k)."""


class Interval(NamedTuple):
    """A 95 % confidence interval."""

    low: float
    high: float

    @property
    def has_width(self) -> bool:
        """Whether the ends differ by more than rounding."""
        return self.high - self.low > _ROUNDING


def wilson_interval(successes: int, trials: int) -> Interval:
    """Return Wilson's 95 % score interval of a success rate, 0 to 1, of independent trials.

    There is at least one trial.
    """
    rate = successes / trials
    weight = Z_95 * Z_95 / trials
    center = (rate + weight / 2) / (1 + weight)
    deviation = math.sqrt(rate * (1 - rate) / trials + weight / (4 * trials))
    half_width = Z_95 * deviation / (1 + weight)
    # The formula gives exactly 0 and 1 at the ends; floating point may not.
    low = 0.0 if successes == 0 else center - half_width
    high = 1.0 if successes == trials else center + half_width
    return Interval(low, high)


def resampled_rates(tasks: Sequence[Rows], rng: np.random.Generator, draws: int = DRAWS) -> Draws:
    """Return bootstrapped success rates: in each draw, episodes are drawn with replacement.

    Episodes with equal rows are drawn together, as multinomial counts. The distribution is that of
    drawing single episodes, but the time does not depend on their number, nor the result on their
    order.

    Args:
        tasks: for each task its episodes, shape (episodes, 2 k): k pairs of successes and trials,
            one pair for each rate. Each task is resampled by itself.
        rng: source of the resamples.
        draws: number of resamples.

    Returns:
        Unweighted means over the tasks, shape (draws, k); nan where a resample has no trial.
    """
    rates = []
    for rows in tasks:
        # Shapes (kinds, 2 k) and (kinds,): the distinct rows, and how many episodes have each.
        kinds, counts = np.unique(rows, axis=0, return_counts=True)
        drawn_counts = rng.multinomial(len(rows), counts / len(rows), size=draws)  # (draws, kinds)
        rates.append(rates_of(drawn_counts @ kinds))
    return np.asarray(np.mean(rates, axis=0), dtype=np.float64)


def rates_of(counts: Rows) -> Draws:
    """Divide successes by trials in each of k pairs of columns: ``(1, 2, 3, 3)`` → ``(0.5, 1)``.

    Returns:
        Shape (rows, k); nan without a trial.
    """
    successes = counts[:, 0::2]
    trials = counts[:, 1::2]
    with np.errstate(invalid="ignore"):
        return np.asarray(successes / trials)


def percentile_interval(values: Draws, sizes: Sequence[int]) -> Interval | None:
    """Return the middle 95 % of resampled values; None unless there are more episodes than tasks.

    Args:
        values: one for each resample, shape (draws,); nan counts as the smallest value for the
            lower end, and as the largest one for the upper end.
        sizes: number of episodes of each task.
    """
    if sum(sizes) <= len(sizes):
        return None
    level = _lower_level(sizes)
    lows = np.where(np.isnan(values), -np.inf, values)
    highs = np.where(np.isnan(values), np.inf, values)
    return Interval(
        float(np.quantile(lows, level, method="inverted_cdf")),
        float(np.quantile(highs, 1 - level, method="inverted_cdf")),
    )


def resampled_interval(values: Draws, sizes: Sequence[int], least: float = 0.0) -> Interval | None:
    """Return the 95 % bootstrap interval of a rate or a gap; None with too few episodes.

    If all resamples have the same value, the bootstrap shows no spread, and the interval is that of
    `without_spread`. Episodes are also too few if so many resamples have no trial that an end is
    not bounded, or if the others all have the same value.

    Args:
        values: one for each resample, shape (draws,); nan if it has no trial.
        sizes: number of episodes of each task.
        least: the smallest value that is possible: 0 for a rate, -1 for a gap.
    """
    interval = percentile_interval(values, sizes)
    if interval is None or not np.isfinite(interval).all():
        return None
    if interval.has_width:
        return interval
    if np.isnan(values).any():
        return None
    return without_spread(interval.low, sum(sizes), least)


def without_spread(value: float, episodes: int, least: float = 0.0) -> Interval:
    """Return a 95 % interval if all observed episodes have the same value, -1 to 1.

    Among all possible episodes, some may have other values, from `least` to 1: at most the share
    that is the upper end of Wilson's interval for 0 successes in as many episodes. For rates of 0
    and 1 this is Wilson's interval on episodes.
    """
    other_share = wilson_interval(0, episodes).high
    same_part = (1 - other_share) * value
    return Interval(same_part + other_share * least, same_part + other_share)


def _lower_level(sizes: Sequence[int]) -> float:
    """Return the quantile, somewhat below 0.025, at which the bootstrap's lower ends are taken.

    Args:
        sizes: number of episodes of each task.

    Resampled means have a variance too small by (n - 1) / n, and normal quantiles instead of
    Student's; quantiles further out correct both (the expanded percentile interval of Hesterberg,
    The American Statistician 69, 2015).
    """
    with extra_needed("Intervals of several seeds or tasks need SciPy", "report"):
        from scipy import special  # SciPy's statistics take a second to import

    episodes = sum(sizes)
    degrees_of_freedom = episodes - len(sizes)  # one less for the mean of each task
    widening = math.sqrt(episodes / degrees_of_freedom)
    return float(special.ndtr(widening * special.stdtrit(degrees_of_freedom, ALPHA / 2)))
