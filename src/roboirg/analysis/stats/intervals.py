"""Intervals of a rate, and the bootstrap over episodes from which all others come.

Several policy seeds play the same episode, and what they achieve there is alike: an episode that is
hard for one seed is hard for the next. So episodes, not trials, are what is drawn anew.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

Z_95 = 1.959963984540054
"""Two-sided 95 % quantile of the normal distribution."""
ALPHA = 0.05
"""How often an interval may miss, and a test may raise a false alarm."""
DRAWS = 4000
"""Bootstrap resamples; the ends of an interval then vary by some 3 % of its length."""

Rows = NDArray[np.int64]
"""One row for each episode: successes and trials, once or more, shape (episodes, 2 k)."""


class Interval(NamedTuple):
    """A 95 % confidence interval."""

    low: float
    high: float


def wilson_interval(successes: int, trials: int, z: float = Z_95) -> Interval:
    """Wilson's score interval of a binomial proportion: right if all trials are independent.

    Raises:
        ValueError: not 0 <= successes <= trials, or no trial.
    """
    if not 0 <= successes <= trials or trials == 0:
        raise ValueError(f"{successes} successes of {trials} trials are not a proportion")
    # In plain Python, because every `roboirg run` and page has it and needs no SciPy otherwise.
    rate, weight = successes / trials, z * z / trials
    center = (rate + weight / 2) / (1 + weight)
    half = z * math.sqrt(rate * (1 - rate) / trials + weight / (4 * trials)) / (1 + weight)
    # At the ends the formula gives 0 and 1 exactly; floating point need not.
    low = 0.0 if successes == 0 else center - half
    high = 1.0 if successes == trials else center + half
    return Interval(low, high)


def unseen_share(episodes: int) -> float:
    """The share of episodes unlike all that were seen, at most: Wilson's upper end for 0 of n."""
    return wilson_interval(0, episodes).high


def resampled_rates(
    tasks: Sequence[Rows], rng: np.random.Generator, draws: int = DRAWS
) -> NDArray[np.float64]:
    """Success rates over resampled episodes, unweighted means over tasks.

    Equal rows are drawn together, as multinomial counts: the same distribution as drawing single
    episodes, in a time that does not depend on their number, and independent of their order.

    Args:
        tasks: for each task its episodes, shape (episodes, 2 k): k times successes and trials;
            each task is resampled by itself.
        rng: where the resamples come from.
        draws: how many.

    Returns:
        Shape (draws, k); nan where a resample has no trial.
    """
    rates = []
    for rows in tasks:
        kinds, counts = np.unique(rows, axis=0, return_counts=True)
        sums = rng.multinomial(len(rows), counts / len(rows), size=draws) @ kinds
        with np.errstate(invalid="ignore"):
            rates.append(sums[:, 0::2] / sums[:, 1::2])
    return np.asarray(np.mean(rates, axis=0), dtype=np.float64)


def percentile_interval(values: NDArray[np.float64], sizes: Sequence[int]) -> Interval | None:
    """The middle 95 % of resampled values; None with too few episodes.

    Args:
        values: one for each resample; what is undefined (nan) counts as the worst on either side.
        sizes: episodes of each task.
    """
    if sum(sizes) <= len(sizes):
        return None
    low, high = _expanded_levels(sizes)
    lows = np.where(np.isnan(values), -np.inf, values)
    highs = np.where(np.isnan(values), np.inf, values)
    return Interval(
        float(np.quantile(lows, low, method="inverted_cdf")),
        float(np.quantile(highs, high, method="inverted_cdf")),
    )


def without_spread(value: float, episodes: int, least: float = 0.0) -> Interval:
    """The interval where all episodes are alike, so that resampling them tells nothing.

    Up to `unseen_share` of all episodes may be unlike them, by anything from `least` to 1.
    For rates of 0 and 1 this is Wilson's interval on episodes.
    """
    share = unseen_share(episodes)
    return Interval((1 - share) * value + share * least, (1 - share) * value + share)


def _expanded_levels(sizes: Sequence[int]) -> tuple[float, float]:
    """Which quantiles to take, so that few episodes do not make intervals too short.

    Resampled means spread by (n - 1) / n too little, and their quantiles are the normal's instead
    of Student's; both are mended by taking quantiles further out (the expanded percentile interval
    of Hesterberg, The American Statistician 69, 2015).
    """
    from scipy import stats

    freedom = sum(sizes) - len(sizes)
    widening = math.sqrt(sum(sizes) / freedom)
    low = float(stats.norm.cdf(widening * stats.t.ppf(ALPHA / 2, freedom)))
    return low, 1 - low
