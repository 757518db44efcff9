"""How many episodes a paired comparison needs, and what a run can find out at all.

All of it is exact for McNemar's exact test with one policy seed. More seeds on the same episodes
help less than as many more episodes would; so what is said here errs on the safe side for them.
"""

from __future__ import annotations

import functools
import math

import numpy as np
from numpy.typing import NDArray

from roboirg.analysis.stats.intervals import ALPHA
from roboirg.core.errors import InvalidValueError

POWER = 0.8
"""How likely a gap shall be found: the usual choice."""
MOST_EPISODES = 100_000
"""Beyond that a number of episodes is no help."""
_REACH = 10.0
"""Standard deviations beyond which nothing happens."""
_TOLERANCE = 1e-4
"""To which a smallest gap is found: a hundredth of a point."""


def mcnemar_power(episodes: int, gap: float, discordance: float, alpha: float = ALPHA) -> float:
    """How likely the exact test finds a difference.

    Args:
        episodes: played by both.
        gap: difference of the two success rates, -1 to 1.
        discordance: share of the episodes that exactly one of the two solves; at least the gap.
        alpha: level of the test.

    Raises:
        InvalidValueError: no such gap and discordance can be.
    """
    _check(gap, discordance)
    if episodes < 1:
        raise InvalidValueError(f"The number of episodes is {episodes}; it must be at least 1.")
    if discordance == 0:
        return 0.0
    from scipy import stats

    unlike, fewest = _rejections(episodes, discordance, alpha)
    share = (1 + abs(gap) / discordance) / 2
    rejected = stats.binom.cdf(fewest, unlike, share)
    rejected += stats.binom.cdf(fewest, unlike, 1 - share)
    return float(stats.binom.pmf(unlike, episodes, discordance) @ np.minimum(rejected, 1.0))


def episodes_needed(
    gap: float, discordance: float, power: float = POWER, alpha: float = ALPHA
) -> int | None:
    """Episodes with which a gap is found with the wanted power; None beyond `MOST_EPISODES`.

    The power of an exact test rises in saw-teeth; this is a number that has it, and at most a
    tooth above the least.

    Raises:
        InvalidValueError: no such gap and discordance can be.
    """
    _check(gap, discordance)
    if gap == 0:
        return None
    low, high = 1, 2
    while mcnemar_power(high, gap, discordance, alpha) < power:
        if high >= MOST_EPISODES:
            return None
        low, high = high, min(2 * high, MOST_EPISODES)
    while high - low > 1:
        middle = (low + high) // 2
        enough = mcnemar_power(middle, gap, discordance, alpha) >= power
        low, high = (low, middle) if enough else (middle, high)
    return high


def smallest_gap(
    episodes: int, discordance: float, power: float = POWER, alpha: float = ALPHA
) -> float | None:
    """The smallest gap that so many episodes find with the wanted power, 0 to 1.

    Args:
        episodes: played by both.
        discordance: share of the episodes that exactly one of the two solves.
        power: wanted.
        alpha: level of the test.

    Returns:
        None if not even that is found where every such episode goes to the same side.
    """
    if mcnemar_power(episodes, discordance, discordance, alpha) < power:
        return None
    low, high = 0.0, discordance
    while high - low > _TOLERANCE:
        middle = (low + high) / 2
        enough = mcnemar_power(episodes, middle, discordance, alpha) >= power
        low, high = (low, middle) if enough else (middle, high)
    return high


@functools.lru_cache(maxsize=64)
def _rejections(
    episodes: int, discordance: float, alpha: float
) -> tuple[NDArray[np.int64], NDArray[np.float64]]:
    """How many episodes may go to one side alone, and when the test then still rejects.

    Returns:
        Numbers of such episodes, all but those with a chance of less than 1e-20; and for each the
        most wins of the rarer side with which the test rejects, -1 where none are few enough.
    """
    from scipy import stats

    center = episodes * discordance
    reach = _REACH * math.sqrt(center * (1 - discordance)) + _REACH
    least, most = max(0, math.floor(center - reach)), min(episodes, math.ceil(center + reach))
    unlike = np.arange(least, most + 1)
    fewest = stats.binom.ppf(alpha / 2, unlike, 0.5)
    fewest -= stats.binom.cdf(fewest, unlike, 0.5) > alpha / 2
    return unlike, fewest


def _check(gap: float, discordance: float) -> None:
    if not 0 <= abs(gap) <= discordance <= 1:
        raise InvalidValueError(
            f"A gap of {gap} with a discordance of {discordance} cannot be; the discordance must "
            "be from the size of the gap to 1."
        )
