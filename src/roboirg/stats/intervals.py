"""Score intervals of rates, of their differences and ratios, and of means of these over tasks.

All are of one kind. An interval holds the true values that a score test does not reject: it asks
how many standard errors the estimate is from such a value, and takes the standard error not from
the data alone, but from the shares of results that are most likely if that value is the true one.
So it has a length even if all episodes ended alike. For a rate of independent trials this is
Wilson's interval, for a difference of two paired ones Tango's (Statistics in Medicine 17, 1998),
for several tasks the stratified one of Miettinen and Nurminen (Statistics in Medicine 4, 1985).
Near 0 and 1 these are too short on the side of the edge, so that end is moved out by the
correction for skewness of Gart and Nam (Biometrics 44, 1988).

Results of several policy seeds in the same episode are correlated: an episode that is hard for one
seed is hard for the next. So the unit is an episode with all of its trials, never a trial.
"""

from __future__ import annotations

import functools
import math
from collections import defaultdict
from collections.abc import Callable, Sequence
from statistics import NormalDist
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

ALPHA = 0.05
"""The one level: the share of intervals that may miss the true value, and of tests that may raise a
false alarm. All intervals, tests and texts derive from it."""
TOO_FEW = "too few episodes"
"""Printed in place of an interval: it takes more episodes than tasks."""

_ROUNDING = 1e-12
"""Differences of rates that are smaller are none."""
_PRECISION = 1e-6
"""Of the ends of an interval, in standard errors."""
_MOST_STEPS = 60
"""Of a search for a root."""
_MOST_DOUBLINGS = 25
"""After these a mean is as large as it can be, but for rounding."""

Rows = NDArray[np.int64]
"""A row for each episode with k pairs of successes and trials, shape (episodes, 2 k)."""


class Interval(NamedTuple):
    """A 95 % confidence interval."""

    low: float
    high: float


def critical_value(alpha: float = ALPHA) -> float:
    """Return how many standard errors a two-sided interval reaches to each side: 1.96 for 95 %.

    Args:
        alpha: share of such intervals that may miss the true value.
    """
    return NormalDist().inv_cdf(1 - alpha / 2)


class Stratum(NamedTuple):
    """What was observed of one task (a stratum), whose mean is a part of a sum.

    Attributes:
        values: the different values that episodes have, in order, such as ``(-1.0, 0.0, 1.0)`` for
            differences of two verdicts.
        shares: of the episodes that have each value; they add up to 1.
        episodes: their number; less if they differ in their weight, as Kish's effective size.
        low: the least mean that is possible. Of an episode that counts little, a value may be less.
        high: the largest one.
    """

    values: tuple[float, ...]
    shares: tuple[float, ...]
    episodes: float
    low: float
    high: float

    @classmethod
    def of(cls, values: ArrayLike, low: float, high: float, weights: ArrayLike = 1.0) -> Stratum:
        """Collect the values of a task's episodes.

        Args:
            values: one for each episode, at least one.
            low: the least mean that is possible.
            high: the largest one.
            weights: above 0, how much each episode counts in the mean; all alike by default.
        """
        numbers = np.asarray(values, dtype=np.float64)
        parts = np.ones_like(numbers) * np.asarray(weights, dtype=np.float64)
        parts /= parts.sum()
        shares: defaultdict[float, float] = defaultdict(float)
        for value, part in zip(numbers.tolist(), parts.tolist(), strict=True):
            shares[value] += part
        in_order = sorted(shares)
        episodes = 1 / float(parts @ parts)
        shares_in_order = tuple(shares[value] for value in in_order)
        return cls(tuple(in_order), shares_in_order, episodes, low, high)

    @property
    def mean(self) -> float:
        return sum(map(float.__mul__, self.values, self.shares))

    def mirrored(self) -> Stratum:
        """Return the same with all signs changed, so that upper ends become lower ones."""
        values = tuple(-value for value in reversed(self.values))
        return Stratum(values, self.shares[::-1], self.episodes, -self.high, -self.low)


class TaskRates(NamedTuple):
    """What the episodes of a task contribute to k rates, such as those of two policies.

    Attributes:
        contributions: shape (episodes, k); a rate is their mean, weighted.
        weights: how much each episode counts, shape (episodes,).
        has_trials: whether a rate is of any trials, shape (k,); it is 0 otherwise.
    """

    contributions: NDArray[np.float64]
    weights: NDArray[np.float64]
    has_trials: NDArray[np.bool_]

    @classmethod
    def of(cls, rows: Rows) -> TaskRates:
        """Return the rates of a task with at least one trial.

        Of two policies with one seed each, an episode that only the first one solved has the row
        ``(1, 1, 0, 1)`` and contributes 1 to the first rate and 0 to the second.

        Args:
            rows: successes and trials of each rate by episode, shape (episodes, 2 k).
        """
        successes = rows[:, 0::2]
        trials = rows[:, 1::2]
        all_trials = trials.sum(axis=0)
        divisors = np.maximum(all_trials, 1)
        # An episode weighs as much as its share of the trials, the mean over the rates.
        weights = (trials / divisors).sum(axis=1)
        weights /= weights.sum()
        contributions = successes / divisors / weights[:, np.newaxis]
        return cls(contributions, weights, all_trials > 0)

    def combined(self, *factors: float) -> Stratum:
        """Return the sum of the rates times a factor each, such as 1 and -1 for their difference.

        A rate without trials is left out.
        """
        used = np.where(self.has_trials, factors, 0.0)
        low = float(np.minimum(used, 0).sum())
        high = float(np.maximum(used, 0).sum())
        return Stratum.of(self.contributions @ used, low, high, self.weights)


def mean_interval(strata: Sequence[Stratum], alpha: float = ALPHA) -> Interval | None:
    """Return the score interval of a sum of means, one for each task; None with too few episodes.

    It takes more episodes than tasks.

    Args:
        strata: of each task. For a mean over tasks, their values are divided by the number of
            tasks.
        alpha: share of such intervals that may miss the true value.
    """
    if _has_too_few(strata):
        return None
    return _interval_of(tuple(strata), critical_value(alpha))


@functools.lru_cache(maxsize=65_536)
def _interval_of(strata: tuple[Stratum, ...], critical: float) -> Interval:
    """Return the interval of a sum of means; the same results are often met again.

    Args:
        strata: of each task.
        critical: standard errors that it reaches to each side.
    """
    high = _upper_end(strata, critical)
    high_of_mirrored = _upper_end([stratum.mirrored() for stratum in strata], critical)
    return Interval(0.0 - high_of_mirrored, high)  # not the negative, which of 0 is −0


def interval_of_values(
    tasks: Sequence[ArrayLike], low: float = 0.0, high: float = 1.0, alpha: float = ALPHA
) -> Interval | None:
    """Return the score interval of a mean over tasks; None with too few values.

    It takes more values than tasks.

    Args:
        tasks: for each task its values, which are independent of each other.
        low: the least value that is possible.
        high: the largest one.
        alpha: share of such intervals that may miss the true value.
    """
    part = 1 / len(tasks)
    strata = []
    for values in tasks:
        parts = part * np.asarray(values, dtype=np.float64)
        strata.append(Stratum.of(parts, part * low, part * high))
    return mean_interval(strata, alpha)


def ratio_interval(tasks: Sequence[TaskRates]) -> Interval | None:
    """Return the 95 % score interval of a ratio of two mean rates; None with too few episodes.

    Of the rates 40 and 80 % the ratio is 0.5. The interval has the ratios r for which the interval
    of the first rate less r times the second has 0. If the second rate is 0 there is none. Its high
    end is infinite if any large ratio would do.

    Args:
        tasks: for each task the two rates.
    """
    part = 1 / len(tasks)

    def difference(ratio: float) -> list[Stratum]:
        return [task.combined(part, -part * ratio) for task in tasks]

    first, second = mean_rates(tasks)
    if second <= _ROUNDING or _has_too_few(difference(1)):
        return None
    interval = _where_zero(difference, first / second)
    return interval._replace(low=max(0.0, interval.low))


def share_interval(tasks: Sequence[TaskRates]) -> Interval | None:
    """Return the 95 % score interval of the share of a gap that something closes.

    Of the rates first, second and third it is (first - second) / (third - second): a gap from 60 to
    80 % that becomes one from 75 to 80 % is closed by three quarters. The interval holds the shares
    s for which the interval of first - (1 - s) second - s third has 0.

    Args:
        tasks: for each task the three rates.

    Returns:
        None with too few episodes, or if the interval of the gap, third - second, does not lie
        above 0: then any share would do.
    """
    part = 1 / len(tasks)
    gap = mean_interval([task.combined(0, -part, part) for task in tasks])
    if gap is None or gap.low <= 0:
        return None

    def difference(share: float) -> list[Stratum]:
        return [task.combined(part, part * (share - 1), -part * share) for task in tasks]

    first, second, third = mean_rates(tasks)
    return _where_zero(difference, (first - second) / (third - second))


def mean_rates(tasks: Sequence[TaskRates]) -> list[float]:
    """Return the means over tasks of their k rates, 0 to 1."""
    rates = [task.weights @ task.contributions for task in tasks]
    means: list[float] = np.mean(rates, axis=0).tolist()
    return means


def _where_zero(difference: Callable[[float], list[Stratum]], estimate: float) -> Interval:
    """Return the numbers for which the 95 % interval of a difference has 0.

    For a ratio r the difference is the first rate less r times the second.

    Args:
        difference: returns the tasks' parts of the difference, whose sum falls with the number.
        estimate: the number for which the difference as observed is 0.
    """
    critical = critical_value()

    # Both are negative where the interval has 0, and positive beyond one of its ends.
    def is_too_large_by(number: float) -> float:
        return -_upper_end(difference(number), critical)

    def is_too_small_by(number: float) -> float:
        mirrored = [stratum.mirrored() for stratum in difference(number)]
        return -_upper_end(mirrored, critical)

    low = _end(is_too_small_by, estimate, -1.0)
    high = _end(is_too_large_by, estimate, 1.0)
    return Interval(low, high)


def _end(function: Callable[[float], float], inside: float, step: float) -> float:
    """Return where a function is 0, on the side of `step` from a place where it is negative.

    The step is doubled until the function is positive; infinite if it never is.
    """
    for _ in range(_MOST_DOUBLINGS):
        if function(inside + step) >= 0:
            return _root(function, inside, inside + step)
        step *= 2
    return math.copysign(math.inf, step)


def _has_too_few(strata: Sequence[Stratum]) -> bool:
    episodes = sum(stratum.episodes for stratum in strata)
    return episodes <= len(strata) + _ROUNDING


class _Moments(NamedTuple):
    """A sum of means: its expectation, its variance, and its third central moment."""

    mean: float
    variance: float
    third: float


def _upper_end(strata: Sequence[Stratum], critical: float) -> float:
    """Return the largest sum of means that a score test does not reject.

    Args:
        strata: of each task.
        critical: standard errors by which the sum as observed may be below a true one.
    """
    estimate = sum(stratum.mean for stratum in strata)
    most = sum(stratum.high for stratum in strata)
    if most - estimate <= _ROUNDING:
        return most
    # About the tilt of a rate of one half, where the search begins.
    first_tilt = 2 * critical * math.sqrt(sum(stratum.episodes for stratum in strata))
    excess = functools.partial(_excess, strata, estimate, critical)
    tilt = _end(excess, 0.0, first_tilt)
    if tilt == math.inf:
        return most
    return min(most, _tilted(strata, tilt).mean)


def _excess(strata: Sequence[Stratum], estimate: float, critical: float, tilt: float) -> float:
    """Return by how many standard errors too many an observed sum is below an expectation.

    Args:
        strata: of each task.
        estimate: the sum as observed.
        critical: standard errors by which it may be below.
        tilt: from which the expectation follows, as of `_tilted`.
    """
    moments = _tilted(strata, tilt)
    distance = moments.mean - estimate
    if distance <= _ROUNDING:
        return -critical
    error = max(math.sqrt(moments.variance), _ROUNDING)
    # A sum with a long tail to the left is often further below its expectation than a normal
    # one. The correction is used only here, where it makes the interval longer.
    skewness = moments.third / error**3
    correction = max(0.0, -skewness / 6) * (critical**2 - 1)
    return distance / error - correction - critical


def _tilted(strata: Sequence[Stratum], tilt: float) -> _Moments:
    """Return the moments of a sum whose expectation is larger than observed, the more with tilt.

    The means lose a degree of freedom for each task; the variance makes up for it.
    """
    mean = 0.0
    variance = 0.0
    third = 0.0
    episodes = 0.0
    for stratum in strata:
        moments = _tilted_values(stratum, tilt / stratum.episodes)
        mean += moments.mean
        variance += moments.variance / stratum.episodes
        third += moments.third / stratum.episodes**2
        episodes += stratum.episodes
    inflation = episodes / (episodes - len(strata))
    return _Moments(mean, variance * inflation, third * inflation**1.5)


def _tilted_values(stratum: Stratum, tilt: float) -> _Moments:
    """Return the moments of an episode's value if large values are more frequent than observed.

    The shares are those of the largest likelihood among all with the same expectation: a value's
    share is divided by a norm less tilt times the value. What is left falls to the largest value
    that is possible, although it was not seen.
    """
    norm = max(_norm(stratum, tilt), tilt * stratum.high)
    left = 1.0
    mean = 0.0
    values = []
    shares = []
    for value, share in zip(stratum.values, stratum.shares, strict=True):
        tilted_share = share / (norm - tilt * value)
        values.append(value)
        shares.append(tilted_share)
        left -= tilted_share
        mean += tilted_share * value
    if left > _ROUNDING:
        values.append(stratum.high)
        shares.append(left)
        mean += left * stratum.high
    variance = 0.0
    third = 0.0
    for value, share in zip(values, shares, strict=True):
        deviation = value - mean
        variance += share * deviation**2
        third += share * deviation**3
    return _Moments(mean, variance, third)


def _norm(stratum: Stratum, tilt: float) -> float:
    """Return the norm with which tilted shares add up to 1, by Newton's method.

    Their sum falls with the norm, ever slower, so the steps rise to the norm from one below it.
    """
    # The norm is at least that of the largest value alone, and that of all episodes at their mean.
    norm = max(tilt * stratum.values[-1] + stratum.shares[-1], 1 + tilt * stratum.mean)
    for _ in range(_MOST_STEPS):
        surplus = -1.0
        slope = 0.0
        for value, share in zip(stratum.values, stratum.shares, strict=True):
            distance = norm - tilt * value
            surplus += share / distance
            slope += share / distance**2
        if surplus <= _ROUNDING:
            break
        norm += surplus / slope
    return norm


def _root(function: Callable[[float], float], below: float, above: float) -> float:
    """Return where a function is 0, by the Illinois method: a false position that cannot stall.

    Args:
        function: of one variable.
        below: where it is negative.
        above: where it is 0 or more; it may be smaller than `below`.
    """
    value_below = function(below)
    value_above = function(above)
    last = 0.0
    place = above
    for _ in range(_MOST_STEPS):
        rise = value_above - value_below
        place = (below * value_above - above * value_below) / rise
        value = function(place)
        if abs(value) <= _PRECISION:
            break
        # An end that stays twice counts half, so that the next place is nearer to it.
        if value > 0:
            above = place
            value_above = value
            if last > 0:
                value_below /= 2
        else:
            below = place
            value_below = value
            if last < 0:
                value_above /= 2
        last = value
    return place
