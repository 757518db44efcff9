"""Power of a paired comparison: the episodes it needs and the gaps it can detect.

Exact for McNemar's exact test with one policy seed. More seeds on the same episodes add power, but
less than the same number of new episodes, so these figures are conservative for them.
"""

from __future__ import annotations

import functools
import math

import numpy as np
from numpy.typing import NDArray

from roboirg.evaluation.analysis.stats.intervals import ALPHA

POWER = 0.8
"""The usual choice of a wanted power."""
MAX_EPISODES = 100_000
"""Larger numbers of episodes are not reported."""
_MAX_DEVIATIONS = 10.0
"""Standard deviations beyond which probabilities are negligible."""
_TOLERANCE = 1e-4
"""Precision of a smallest gap: a hundredth of a point."""


def mcnemar_power(episodes: int, gap: float, discordance: float) -> float:
    """Return the probability that the exact test finds a difference.

    Args:
        episodes: played by both, at least one.
        gap: difference of the two success rates, -1 to 1.
        discordance: share of the episodes that exactly one of the two solves; at least the gap.
    """
    if discordance == 0:
        return 0.0
    from scipy import stats

    unlike, fewest = _rejections(episodes, discordance)
    share = (1 + abs(gap) / discordance) / 2
    rejected = stats.binom.cdf(fewest, unlike, share)
    rejected += stats.binom.cdf(fewest, unlike, 1 - share)
    return float(stats.binom.pmf(unlike, episodes, discordance) @ np.minimum(rejected, 1.0))


def episodes_needed(gap: float, discordance: float) -> int | None:
    """Return the episodes that detect a gap with the wanted power; None above `MAX_EPISODES`.

    The power of an exact test rises in a sawtooth; the number has the wanted power and is at most
    one tooth above the smallest such number.
    """
    if gap == 0:
        return None
    low, high = 1, 2
    while mcnemar_power(high, gap, discordance) < POWER:
        if high >= MAX_EPISODES:
            return None
        low, high = high, min(2 * high, MAX_EPISODES)
    while high - low > 1:
        middle = (low + high) // 2
        enough = mcnemar_power(middle, gap, discordance) >= POWER
        low, high = (low, middle) if enough else (middle, high)
    return high


def smallest_gap(episodes: int, discordance: float) -> float | None:
    """Return the smallest gap that episodes detect with the wanted power, 0 to 1.

    Returns:
        None if even the largest gap, with all discordant episodes on one side, is not detected.
    """
    if mcnemar_power(episodes, discordance, discordance) < POWER:
        return None
    low, high = 0.0, discordance
    while high - low > _TOLERANCE:
        middle = (low + high) / 2
        enough = mcnemar_power(episodes, middle, discordance) >= POWER
        low, high = (low, middle) if enough else (middle, high)
    return high


@functools.lru_cache(maxsize=64)
def _rejections(episodes: int, discordance: float) -> tuple[NDArray[np.int64], NDArray[np.float64]]:
    """Return numbers of discordant episodes and, for each, when the test rejects.

    Returns:
        The numbers of discordant episodes, but for those with a probability below 1e-20; and for
        each the most wins of the rarer side with which the test rejects, -1 if it never does.
    """
    from scipy import stats

    center = episodes * discordance
    reach = _MAX_DEVIATIONS * math.sqrt(center * (1 - discordance)) + _MAX_DEVIATIONS
    least, most = max(0, math.floor(center - reach)), min(episodes, math.ceil(center + reach))
    unlike = np.arange(least, most + 1)
    fewest = stats.binom.ppf(ALPHA / 2, unlike, 0.5)
    fewest -= stats.binom.cdf(fewest, unlike, 0.5) > ALPHA / 2
    return unlike, fewest
