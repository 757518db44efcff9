"""Two samples on the same episodes: gap, tests, retention, overlap."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from roboirg.analysis.stats.intervals import (
    DRAWS,
    Interval,
    Rows,
    percentile_interval,
    resampled_rates,
    without_spread,
)
from roboirg.analysis.stats.samples import CellResults


class Overlap(NamedTuple):
    """What two samples did in the same trials (episode and policy seed).

    Attributes:
        both: trials solved in both.
        only_first: in the first alone.
        only_second: in the second alone.
        neither: in neither.
    """

    both: int
    only_first: int
    only_second: int
    neither: int

    @property
    def trials(self) -> int:
        """All of them."""
        return sum(self)

    @property
    def discordance(self) -> float | None:
        """Share of the trials that exactly one solves; None without trials."""
        return (self.only_first + self.only_second) / self.trials if self.trials else None


@dataclass(frozen=True, slots=True)
class Pairs:
    """Two samples of one task, episode by episode.

    Attributes:
        rows: for each episode that has verdicts in both: successes and trials of the first, then
            of the second; shape (episodes, 4). Of the policy seeds those that both have, or all
            where they share none.
        overlap: over the trials that both have.
    """

    rows: Rows
    overlap: Overlap

    @classmethod
    def of(cls, first: CellResults, second: CellResults) -> Pairs:
        """Pair two samples of the same task."""
        ours, theirs = first.by_episode(), second.by_episode()
        rows = []
        for episode in sorted(ours.keys() & theirs.keys()):
            here, there = ours[episode], theirs[episode]
            shared = here.keys() & there.keys()
            ours_shared = [won for seed, won in here.items() if seed in shared or not shared]
            theirs_shared = [won for seed, won in there.items() if seed in shared or not shared]
            rows.append(
                (sum(ours_shared), len(ours_shared), sum(theirs_shared), len(theirs_shared))
            )
        trials = [
            (won, second.verdicts[at])
            for at, won in first.verdicts.items()
            if at in second.verdicts
        ]
        overlap = Overlap(
            both=trials.count((True, True)),
            only_first=trials.count((True, False)),
            only_second=trials.count((False, True)),
            neither=trials.count((False, False)),
        )
        return cls(np.array(rows, dtype=np.int64).reshape(-1, 4), overlap)

    @property
    def differences(self) -> NDArray[np.int64]:
        """By how much the first succeeded more often in each episode, in whole numbers.

        In trials where both have as many of them, else in shares times both numbers of trials.
        """
        won, tried, lost, sought = self.rows.T
        if np.array_equal(tried, sought):
            return np.asarray(won - lost)
        return np.asarray(won * sought - lost * tried)


@dataclass(frozen=True, slots=True)
class Gap:
    """How much better the first of two is, over one task or the unweighted mean of several.

    Attributes:
        value: difference of the success rates on the same episodes, -1 to 1.
        interval: of it, from the paired bootstrap over episodes.
        p_value: of the hypothesis that it makes no difference; not corrected.
        retention: success rate of the first by that of the second; None where that is 0.
        retention_interval: of it; ends that the data do not bound are infinite.
        episodes: that were paired.
        overlap: of their trials.
    """

    value: float
    interval: Interval | None
    p_value: float
    retention: float | None
    retention_interval: Interval | None
    episodes: int
    overlap: Overlap


def measure_gap(tasks: Sequence[Pairs], rng: np.random.Generator, draws: int = DRAWS) -> Gap | None:
    """The gap between the first and the second; None if no task has a pair."""
    paired = [pairs for pairs in tasks if len(pairs.rows)]
    if not paired:
        return None
    rows = [pairs.rows for pairs in paired]
    sizes = [len(each) for each in rows]
    sums = np.array([each.sum(axis=0) for each in rows], dtype=np.float64)
    first, second = np.mean(sums[:, 0::2] / sums[:, 1::2], axis=0)
    drawn = resampled_rates(rows, rng, draws)
    return Gap(
        value=float(first - second),
        interval=_gap_interval(drawn, sizes),
        p_value=sign_flip_test(np.concatenate([pairs.differences for pairs in paired])),
        retention=float(first / second) if second else None,
        retention_interval=_retention_interval(drawn, sizes) if second else None,
        episodes=sum(sizes),
        overlap=Overlap._make(np.sum([pairs.overlap for pairs in paired], axis=0).tolist()),
    )


def mcnemar_test(only_first: int, only_second: int) -> float:
    """McNemar's exact test: two-sided p-value of the trials that exactly one of two solves."""
    from scipy import stats

    unlike = only_first + only_second
    return float(stats.binomtest(only_first, unlike).pvalue) if unlike else 1.0


def sign_flip_test(differences: NDArray[np.int64]) -> float:
    """The exact test that the two of each pair could be swapped: a two-sided p-value.

    The sum of the differences is compared with what all ways to swap the two within episodes
    give. With one policy seed the differences are -1, 0 and 1, and this is McNemar's exact test;
    with several it stays right although the seeds of an episode are alike.

    Args:
        differences: one for each episode, whole numbers.
    """
    sizes = np.abs(differences[differences != 0])
    if not len(sizes):
        return 1.0
    sizes //= np.gcd.reduce(sizes)
    total = int(sizes.sum())
    # Probability of every sum of those that fall to the first.
    chances = np.zeros(total + 1)
    chances[0] = 1.0
    for size in sizes.tolist():
        chances[size:] = (chances[size:] + chances[:-size]) / 2
        chances[:size] /= 2
    positive = int(sizes[differences[differences != 0] > 0].sum())
    as_far = np.abs(2 * np.arange(total + 1) - total) >= abs(2 * positive - total)
    return min(1.0, float(chances[as_far].sum()))


def _gap_interval(drawn: NDArray[np.float64], sizes: Sequence[int]) -> Interval | None:
    values = drawn[:, 0] - drawn[:, 1]
    interval = percentile_interval(values, sizes)
    if interval is not None and np.ptp(values) == 0:
        return without_spread(float(values[0]), sum(sizes), least=-1.0)
    return interval


def _retention_interval(drawn: NDArray[np.float64], sizes: Sequence[int]) -> Interval | None:
    with np.errstate(divide="ignore", invalid="ignore"):
        values = drawn[:, 0] / drawn[:, 1]
    interval = percentile_interval(values, sizes)
    if interval is None:
        return None
    if np.ptp(drawn, axis=0).any():
        return Interval(max(0.0, interval.low), interval.high)
    first, second = (without_spread(rate, sum(sizes)) for rate in drawn[0].tolist())
    return Interval(first.low / second.high, first.high / second.low)
