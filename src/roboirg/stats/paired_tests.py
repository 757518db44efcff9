"""Paired comparison of two cells on the same episodes: gap, test, retention, overlap."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from roboirg.stats.cells import Cell
from roboirg.stats.intervals import Interval, Rows, TaskRates, mean_interval, ratio_interval


class Overlap(NamedTuple):
    """Outcomes of two cells in the trials (episode and policy seed) that they share.

    Attributes:
        both: trials that succeed in both cells.
        only_first: trials that succeed in the first cell alone.
        only_second: trials that succeed in the second cell alone.
        neither: trials that succeed in neither cell.
    """

    both: int
    only_first: int
    only_second: int
    neither: int

    @property
    def trials(self) -> int:
        """Number of shared trials."""
        return sum(self)

    @property
    def discordance(self) -> float | None:
        """Share of the trials that succeed in exactly one cell; None without trials."""
        if not self.trials:
            return None
        return (self.only_first + self.only_second) / self.trials


@dataclass(frozen=True)
class Pairs:
    """Two cells of one task, paired by episode.

    Attributes:
        rows: for each episode with verdicts in both cells, successes and trials of the first,
            then of the second; shape (episodes, 4). Counts the policy seeds that both cells have,
            or all seeds if they share none.
        overlap: of the trials that both cells have.
    """

    rows: Rows
    overlap: Overlap

    @classmethod
    def of(cls, first: Cell, second: Cell) -> Pairs:
        """Pair the trials of two policies, or of one in two settings, by episode of the same task.

        An episode in which the first succeeded with one of two seeds, and the second with both,
        has the row ``(1, 2, 2, 2)``: successes and trials of the first, then of the second.
        """
        rows = list(paired_episodes(first, second).values())
        return cls(np.array(rows, dtype=np.int64).reshape(-1, 4), _overlap(first, second))

    @cached_property
    def rates(self) -> TaskRates:
        """What the episodes contribute to the success rates of the two."""
        return TaskRates.of(self.rows)

    @property
    def trials(self) -> int:
        """Number of trials of both cells."""
        return int(self.rows[:, 1::2].sum())

    @property
    def differences(self) -> NDArray[np.int64]:
        """By how much the first cell is better in each episode, as whole numbers, (episodes,).

        They are in successes if both cells have equally many trials in every episode. Else they are
        differences of success rates, times both numbers of trials to make them whole: one of two
        against two of three gives 1 · 3 - 2 · 2 = -1.
        """
        first, first_trials, second, second_trials = self.rows.T
        if np.array_equal(first_trials, second_trials):
            return np.asarray(first - second)
        return np.asarray(first * second_trials - second * first_trials)


class PairedEpisode(NamedTuple):
    """Numbers of trials of two cells in one episode."""

    first_wins: int
    first_trials: int
    second_wins: int
    second_trials: int


def paired_episodes(first: Cell, second: Cell) -> dict[int, PairedEpisode]:
    """Return successes and trials of two cells in each episode with verdicts in both, in order.

    Counts the policy seeds that both cells have, or all seeds if they share none.
    """
    first_episodes = first.by_episode()
    second_episodes = second.by_episode()
    paired = {}
    for episode in sorted(first_episodes.keys() & second_episodes.keys()):
        first_by_seed = first_episodes[episode]
        second_by_seed = second_episodes[episode]
        shared_seeds = first_by_seed.keys() & second_by_seed.keys()
        if shared_seeds:
            first_by_seed = {seed: first_by_seed[seed] for seed in shared_seeds}
            second_by_seed = {seed: second_by_seed[seed] for seed in shared_seeds}
        first_wins = sum(first_by_seed.values())
        second_wins = sum(second_by_seed.values())
        paired[episode] = PairedEpisode(
            first_wins, len(first_by_seed), second_wins, len(second_by_seed)
        )
    return paired


def _overlap(first: Cell, second: Cell) -> Overlap:
    """Count in how many shared trials both cells succeeded, one alone, or neither.

    A trial, an episode with a policy seed, is shared if both cells have a verdict on it.
    """
    counts: Counter[tuple[bool, bool]] = Counter()
    for trial, first_won in first.verdicts.items():
        if trial in second.verdicts:
            counts[first_won, second.verdicts[trial]] += 1
    return Overlap(
        both=counts[True, True],
        only_first=counts[True, False],
        only_second=counts[False, True],
        neither=counts[False, False],
    )


@dataclass(frozen=True)
class Gap:
    """Difference between two cells of a task, or the unweighted mean over several tasks.

    Attributes:
        value: success rate of the first less that of the second on the same episodes, -1 to 1.
        interval: 95 %, of the value; None with too few episodes.
        p_value: of the null hypothesis of no difference; not corrected.
        retention: success rate of the first by that of the second; None if the latter is 0.
        tasks: number of tasks with pairs.
        episodes: number of paired episodes.
        trials: number of paired trials, of both.
        overlap: of their trials.
        rates_of_tasks: of each task the first rate and the second.
    """

    value: float
    interval: Interval | None
    p_value: float
    retention: float | None
    tasks: int
    episodes: int
    trials: int
    overlap: Overlap
    rates_of_tasks: Sequence[TaskRates] = field(repr=False, compare=False)

    @cached_property
    def retention_interval(self) -> Interval | None:
        """95 %, of the retention; None without one, or with too few episodes."""
        return ratio_interval(self.rates_of_tasks)


class PairedRates(NamedTuple):
    """Success rates of two cells on the same episodes, as means over tasks, 0 to 1."""

    first: float
    second: float


def paired_rates(tasks: Sequence[Pairs]) -> PairedRates | None:
    """Return the rates over the tasks that have pairs; None if no task has any."""
    rates = []
    for pairs in tasks:
        if len(pairs.rows):
            successes, trials, other_successes, other_trials = pairs.rows.sum(axis=0).tolist()
            rates.append((successes / trials, other_successes / other_trials))
    if not rates:
        return None
    return PairedRates._make(np.mean(rates, axis=0).tolist())


def measure_gap(tasks: Sequence[Pairs]) -> Gap | None:
    """Measure by how much two success rates on the same episodes differ, as means over tasks.

    Returns the difference with its interval and p-value, and the ratio of the rates. None if no
    task has episodes with verdicts on both sides.

    Args:
        tasks: for each task, the results of both sides, paired by episode.
    """
    paired = [pairs for pairs in tasks if len(pairs.rows)]
    rates = paired_rates(paired)
    if rates is None:
        return None
    rates_of_tasks = [pairs.rates for pairs in paired]
    differences = np.concatenate([pairs.differences for pairs in paired])
    overlaps = np.sum([pairs.overlap for pairs in paired], axis=0)
    retention = None
    if rates.second:
        retention = rates.first / rates.second
    return Gap(
        value=rates.first - rates.second,
        interval=_gap_interval(rates_of_tasks),
        p_value=sign_flip_test(differences),
        retention=retention,
        tasks=len(paired),
        episodes=len(differences),
        trials=sum(pairs.trials for pairs in paired),
        overlap=Overlap._make(overlaps.tolist()),
        rates_of_tasks=rates_of_tasks,
    )


def _gap_interval(tasks: Sequence[TaskRates]) -> Interval | None:
    """Return the 95 % interval of the first rate less the second, the mean over tasks."""
    part = 1 / len(tasks)
    return mean_interval([task.combined(part, -part) for task in tasks])


def sign_flip_test(differences: NDArray[np.int64]) -> float:
    """Return the two-sided p-value of no difference between two sides, by flipping signs.

    If the sides do not differ, each episode's difference could as well have the other sign. The
    p-value is the share of all choices of signs whose sum is at least as far from 0 as that of the
    differences: 0.25 for ``[1, 1, 1]``. With one policy seed this is McNemar's exact test; with
    several it stays valid although the trials of an episode are correlated.

    Args:
        differences: first side less second in each episode, shape (episodes,).
    """
    nonzero = differences[differences != 0]
    if not len(nonzero):
        return 1.0
    sizes = np.abs(nonzero)
    sizes //= np.gcd.reduce(sizes)  # smaller numbers with the same chances, so fewer sums
    total = int(sizes.sum())

    # By its place, the probability of each sum of the sizes with a positive sign, from 0 to all;
    # each size in turn is in the sum with a probability of one half.
    chances = np.zeros(total + 1)
    chances[0] = 1.0
    for size in sizes.tolist():
        chances[size:] = (chances[size:] + chances[:-size]) / 2
        chances[:size] /= 2

    # If these sizes are positive, all others are negative: the signed sum is twice theirs less all.
    signed_sums = 2 * np.arange(total + 1) - total
    positive = int(sizes[nonzero > 0].sum())
    is_as_far = np.abs(signed_sums) >= abs(2 * positive - total)
    return min(1.0, float(chances[is_as_far].sum()))


def holm(p_values: Sequence[float]) -> tuple[float, ...]:
    """Correct p-values for testing several hypotheses at once, by Holm's method; keep their order.

    For example 0.01 and 0.04 become 0.02 and 0.04: the smallest is multiplied by the number of
    tests, the next one by one less, and none is smaller than one before it.

    Rejecting those of at most 0.05 keeps the probability of any false alarm at 0.05 or below,
    whatever the dependence between the tests.
    """
    # Statsmodels has this too, but collects garbage in every call, which visits all records.
    values = np.asarray(p_values, dtype=np.float64)
    order = np.argsort(values)
    factors = np.arange(len(values), 0, -1)  # the smallest p-value times the number of tests
    adjusted = np.empty_like(values)
    adjusted[order] = np.maximum.accumulate(values[order] * factors)
    return tuple(np.minimum(adjusted, 1.0).tolist())
