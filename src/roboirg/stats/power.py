"""Power of a paired comparison: the episodes it needs and the gaps it can detect.

Exact for McNemar's exact test with one policy seed. More seeds on the same episodes add power, but
less than the same number of new episodes, so these figures are conservative for them.
"""

from __future__ import annotations

import functools
import math
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from roboirg.stats.intervals import ALPHA, critical_value

POWER = 0.8
"""The usual choice of a wanted power."""
MAX_EPISODES = 100_000
"""Larger numbers of episodes are not reported."""
_MAX_DEVIATIONS = 10.0
"""Standard deviations beyond which probabilities are negligible."""
_TOLERANCE = 1e-4
"""Precision of a smallest gap: a hundredth of a point."""
_BLOCK = 256
"""Numbers of discordant episodes whose quantiles are computed together, and kept."""


def mcnemar_power(episodes: int, gap: float, discordance: float) -> float:
    """Return the probability that McNemar's exact test at the 5 % level finds a difference.

    Args:
        episodes: played by both policies, at least one.
        gap: difference of the two success rates, -1 to 1.
        discordance: share of the episodes that exactly one of the two solves; at least the gap.
    """
    if discordance == 0:
        return 0.0
    rejections = _rejections(episodes, discordance)
    counts = rejections.discordant
    # Share of the discordant episodes that the better one solves.
    share = (1 + abs(gap) / discordance) / 2
    # For each number of discordant episodes: the better one, or the other one, wins few enough.
    rejected = _chance_of_at_most(rejections.most_wins, counts, share)
    rejected += _chance_of_at_most(rejections.most_wins, counts, 1 - share)
    return float(rejections.chances @ np.minimum(rejected, 1.0))


def _chance_of_at_most(
    wins: NDArray[Any], episodes: int | NDArray[np.int64], share: float
) -> NDArray[np.float64]:
    """Return how likely no more than some wins are, for each number of episodes; 0 for -1 wins."""
    # SciPy's module of distributions does the same, but takes a second to import.
    from scipy import special

    return np.where(wins < 0, 0.0, special.bdtr(np.maximum(wins, 0), episodes, share))


def episodes_needed(gap: float, discordance: float) -> int | None:
    """Return how many episodes detect a gap with 80 % power; None above `MAX_EPISODES`.

    The power of an exact test does not rise steadily with the episodes, but in a sawtooth, so the
    search by halves may end one tooth above the smallest number that would do.

    Args:
        gap: difference of the two success rates, -1 to 1.
        discordance: share of the episodes that exactly one of the two solves; at least the gap.
    """
    if gap == 0:
        return None
    # Doubles an upper bound first, and then halves the distance to the lower one.
    low = 1
    high = 2
    while mcnemar_power(high, gap, discordance) < POWER:
        if high >= MAX_EPISODES:
            return None
        low = high
        high = min(2 * high, MAX_EPISODES)
    while high - low > 1:
        middle = (low + high) // 2
        if mcnemar_power(middle, gap, discordance) >= POWER:
            high = middle
        else:
            low = middle
    return high


def smallest_gap(episodes: int, discordance: float) -> float | None:
    """Return the smallest gap between two success rates that is detected with 80 % power, 0 to 1.

    Args:
        episodes: played by both policies, at least one.
        discordance: share of the episodes that exactly one of the two solves.

    Returns:
        None if even the largest gap, with all discordant episodes on one side, is not detected.
    """
    if mcnemar_power(episodes, discordance, discordance) < POWER:
        return None
    low = 0.0
    high = discordance
    while high - low > _TOLERANCE:
        middle = (low + high) / 2
        if mcnemar_power(episodes, middle, discordance) >= POWER:
            high = middle
        else:
            low = middle
    return high


class _Rejections(NamedTuple):
    """When the test rejects.

    Attributes:
        discordant: numbers of discordant episodes, but for those with a negligible probability.
        most_wins: for each, the most wins of the rarer side with which the test rejects; -1 if it
            never does.
        chances: of each, by the binomial distribution.
    """

    discordant: NDArray[np.int64]
    most_wins: NDArray[np.float64]
    chances: NDArray[np.float64]


@functools.lru_cache(maxsize=64)
def _rejections(episodes: int, discordance: float) -> _Rejections:
    """Return with how few wins of the rarer side McNemar's exact test rejects, at the 5 % level."""
    counts = _likely_counts(episodes, discordance)
    first_block = counts[0] // _BLOCK
    blocks = range(first_block, counts[-1] // _BLOCK + 1)
    most_wins = np.concatenate(list(map(_most_wins_in_block, blocks)))
    start = counts[0] - first_block * _BLOCK
    # One more below, as a count's chance is that of at most it less that of at most the one before.
    counts_and_one_below = np.arange(counts[0] - 1, counts[-1] + 1)
    chances = np.diff(_chance_of_at_most(counts_and_one_below, episodes, discordance))
    return _Rejections(np.array(counts), most_wins[start : start + len(counts)], chances)


def _likely_counts(episodes: int, discordance: float) -> range:
    """Return numbers of discordant episodes, which exactly one of the two solves.

    Those that are too improbable to matter, below 1e-20, are left out.
    """
    center = episodes * discordance
    deviation = math.sqrt(center * (1 - discordance))
    reach = _MAX_DEVIATIONS * deviation + _MAX_DEVIATIONS
    least = max(0, math.floor(center - reach))
    most = min(episodes, math.ceil(center + reach))
    return range(least, most + 1)


@functools.cache
def _most_wins_in_block(block: int) -> NDArray[np.float64]:
    """Return the most wins of the rarer side with which the test rejects; -1 if it never does.

    They depend on nothing but the number of discordant episodes. Block 2 has those of 512 to 767
    discordant episodes, shape (256,).
    """
    discordant = np.arange(block * _BLOCK, (block + 1) * _BLOCK)
    # Begins a little below what a normal distribution has.
    most_wins = np.floor(discordant / 2 - critical_value() * np.sqrt(discordant) / 2) - 2
    most_wins = np.maximum(most_wins, -1.0)
    has_room = np.ones(_BLOCK, dtype=np.bool_)
    while has_room.any():
        has_room = _chance_of_at_most(most_wins + 1, discordant, 0.5) <= ALPHA / 2
        most_wins += has_room
    return np.asarray(most_wins)
