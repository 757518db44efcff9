"""Intervals by hand, against libraries, and by simulation."""

from __future__ import annotations

import os

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from roboirg.evaluation.analysis.stats.cells import (
    CellResults,
    Trial,
    cell_interval,
    clustered_interval,
)
from roboirg.evaluation.analysis.stats.intervals import (
    percentile_interval,
    resampled_rates,
    unseen_share,
    wilson_interval,
    without_spread,
)
from roboirg.evaluation.analysis.stats.paired_tests import Pairs, measure_gap, sign_flip_test

LONG = "ROBOIRG_LONG_TESTS" in os.environ
"""Ten times as many simulated runs."""
RUNS = 6000 if LONG else 600
DRAWS = 1000
NOMINAL = (0.93, 0.97)
SLACK = 2.6 * np.sqrt(0.05 * 0.95 / RUNS)
"""What chance alone does to a simulated share, in 99 of 100 cases."""


def cell(won: np.ndarray) -> CellResults:
    """Of an array (episodes, seeds)."""
    return CellResults(
        {
            Trial(episode, seed): bool(value)
            for episode, row in enumerate(won)
            for seed, value in enumerate(row)
        }
    )


def played(
    rng: np.random.Generator, rate: float, episodes: int, seeds: int, alike: float
) -> np.ndarray:
    """Verdicts whose correlation between the seeds of an episode is `alike`."""
    chances = np.full(episodes, rate)
    if alike:
        spread = 1 / alike - 1
        chances = rng.beta(rate * spread, (1 - rate) * spread, size=episodes)
    return rng.random((episodes, seeds)) < chances[:, None]


def is_nominal(share: float) -> bool:
    return NOMINAL[0] - SLACK <= share <= NOMINAL[1] + SLACK


# By hand, z = 1.96: 8 of 10 is 0.8 with weight 0.38415, center 0.99207 / 1.38415 = 0.71674,
# half 1.96 * sqrt(0.016 + 0.0096036) / 1.38415 = 0.22658. Also in Newcombe 1998, table I.
@pytest.mark.parametrize(
    ("successes", "trials", "low", "high"),
    [
        (8, 10, 0.4902, 0.9433),
        (81, 263, 0.2553, 0.3662),
        (15, 148, 0.0624, 0.1605),
        (0, 20, 0.0, 0.1611),
        (20, 20, 0.8389, 1.0),
    ],
)
def test_wilson(successes: int, trials: int, low: float, high: float) -> None:
    assert wilson_interval(successes, trials) == pytest.approx((low, high), abs=5e-5)


@pytest.mark.parametrize(("successes", "trials"), [(0, 0), (3, 2), (-1, 2)])
def test_no_interval_of_nonsense(successes: int, trials: int) -> None:
    with pytest.raises(ValueError, match="not a proportion"):
        wilson_interval(successes, trials)


@given(st.integers(1, 400).flatmap(lambda n: st.tuples(st.integers(0, n), st.just(n))))
def test_wilson_is_that_of_statsmodels(counts: tuple[int, int]) -> None:
    from statsmodels.stats.proportion import proportion_confint

    assert wilson_interval(*counts) == pytest.approx(
        proportion_confint(*counts, method="wilson"), abs=1e-12
    )


def test_the_exact_coverage_of_wilson_is_nominal() -> None:
    """No simulation: 50 trials, mean over rates; and nowhere from 10 to 90 % below 92."""
    from scipy import stats

    ends = np.array([wilson_interval(won, 50) for won in range(51)])
    rates = np.linspace(0.1, 0.9, 81)
    hits = (ends[:, :1] <= rates) & (rates <= ends[:, 1:])
    coverage = (hits * stats.binom.pmf(np.arange(51)[:, None], 50, rates)).sum(axis=0)
    assert NOMINAL[0] < coverage.mean() < NOMINAL[1]
    assert coverage.min() > 0.92


def test_resampled_rates_are_those_of_the_episodes() -> None:
    """By hand: two episodes, 1 of 1 and 0 of 3; resamples are AA, AB, BA, BB."""
    rows = np.array([[1, 1], [0, 3]])
    drawn = resampled_rates([rows], np.random.default_rng(1), 40_000)[:, 0]
    values, counts = np.unique(drawn, return_counts=True)
    assert values.tolist() == [0.0, 0.25, 1.0]
    assert counts / 40_000 == pytest.approx([0.25, 0.5, 0.25], abs=0.01)


def test_averages_over_tasks_are_not_weighted_by_episodes() -> None:
    tasks = [np.array([[1, 1]] * 90), np.array([[0, 1]] * 10)]
    assert set(resampled_rates(tasks, np.random.default_rng(1), 10)[:, 0]) == {0.5}


def test_the_order_of_episodes_and_the_hour_make_no_difference() -> None:
    rng = np.random.default_rng(3)
    won = played(rng, 0.4, 40, 3, 0.3)
    first, again, mixed = (
        clustered_interval([cell(rows)], np.random.default_rng(5))
        for rows in (won, won, rng.permutation(won))
    )
    assert first == again == mixed


def test_resampling_agrees_with_scipy_but_for_the_expansion() -> None:
    from scipy import stats

    won = played(np.random.default_rng(4), 0.3, 60, 1, 0)[:, 0]
    theirs = stats.bootstrap(
        (won.astype(float),), np.mean, method="percentile", n_resamples=20_000, rng=1
    ).confidence_interval
    rows = np.column_stack([won, np.ones(60)]).astype(np.int64)
    drawn = resampled_rates([rows], np.random.default_rng(1), 20_000)[:, 0]
    assert np.quantile(drawn, [0.025, 0.975]) == pytest.approx(theirs, abs=0.02)
    ours = percentile_interval(drawn, [60])
    assert ours is not None
    assert ours.low <= theirs.low + 0.001
    assert ours.high >= theirs.high - 0.001


def test_where_all_is_alike_what_was_not_seen_is_allowed_for() -> None:
    """By hand: z² / (50 + z²) = 3.8415 / 53.8415 = 0.07135."""
    assert unseen_share(50) == pytest.approx(0.07135, abs=1e-5)
    assert without_spread(0.0, 50) == pytest.approx((0, 0.07135), abs=1e-5)
    assert without_spread(1.0, 50) == pytest.approx((0.92865, 1), abs=1e-5)
    assert without_spread(0.0, 50, least=-1) == pytest.approx((-0.07135, 0.07135), abs=1e-5)
    assert without_spread(-1.0, 50, least=-1) == pytest.approx((-1, -0.85730), abs=1e-5)
    none = cell(np.zeros((50, 3), dtype=bool))
    assert clustered_interval([none], np.random.default_rng(0)) == without_spread(0.0, 50)


def test_with_several_seeds_the_clustered_interval_is_shown() -> None:
    rng = np.random.default_rng(2)
    once, thrice = (cell(played(rng, 0.4, 50, seeds, 0.5)) for seeds in (1, 3))
    assert cell_interval(once, np.random.default_rng(0)) == wilson_interval(once.successes, 50)
    assert cell_interval(thrice, np.random.default_rng(0)) == clustered_interval(
        [thrice], np.random.default_rng(0)
    )
    assert cell_interval(CellResults(), rng) is None
    assert clustered_interval([once, CellResults()], rng) is None
    assert clustered_interval([cell(np.ones((1, 3), dtype=bool))], rng) is None


@pytest.mark.parametrize("alike", [0.0, 0.5])
@pytest.mark.parametrize("rate", [0.3, 0.5, 0.8])
def test_the_clustered_interval_covers(rate: float, alike: float) -> None:
    """50 episodes, 3 seeds. Wilson's on trials does so only if the seeds are independent."""
    rng = np.random.default_rng(11)
    hits = np.zeros(2)
    for _ in range(RUNS):
        one = cell(played(rng, rate, 50, 3, alike))
        naive = wilson_interval(one.successes, one.trials)
        intervals = clustered_interval([one], rng, DRAWS), naive
        hits += [each is not None and each.low <= rate <= each.high for each in intervals]
    clustered, by_trials = hits / RUNS
    assert is_nominal(clustered)
    assert is_nominal(by_trials) == (alike == 0)


def test_the_interval_of_an_average_covers() -> None:
    """Three tasks of different rates and numbers of episodes."""
    rng = np.random.default_rng(12)
    truth, hits = np.mean([0.2, 0.5, 0.9]), 0
    for _ in range(RUNS):
        tasks = [
            cell(played(rng, rate, episodes, 3, 0.4))
            for rate, episodes in ((0.2, 30), (0.5, 50), (0.9, 40))
        ]
        found = clustered_interval(tasks, rng, DRAWS)
        hits += found is not None and found.low <= truth <= found.high
    assert is_nominal(hits / RUNS)


@pytest.mark.parametrize("seeds", [1, 3])
def test_the_intervals_of_gap_and_retention_cover(seeds: int) -> None:
    rng = np.random.default_rng(13)
    hits = np.zeros(2)
    for _ in range(RUNS):
        ease = rng.beta(2, 2, size=50)
        second = rng.random((50, seeds)) < ease[:, None]
        first = rng.random((50, seeds)) < 0.6 * ease[:, None]
        gap = measure_gap([Pairs.of(cell(first), cell(second))], rng, DRAWS)
        assert gap is not None
        assert gap.interval is not None
        assert gap.retention_interval is not None
        hits += [
            gap.interval.low <= -0.2 <= gap.interval.high,
            gap.retention_interval.low <= 0.6 <= gap.retention_interval.high,
        ]
    assert all(map(is_nominal, hits / RUNS))


@pytest.mark.parametrize("seeds", [1, 3])
def test_the_test_raises_few_false_alarms(seeds: int) -> None:
    """Words that harm some episodes and help as many others: no difference on average.

    McNemar's test over single trials raises far too many with several seeds.
    """
    rng = np.random.default_rng(14)
    alarms = np.zeros(2)
    for _ in range(2 * RUNS):
        chances = rng.choice([0.1, 0.9], size=(2, 50))
        won, lost = (rng.random((50, seeds)) < side[:, None] for side in chances)
        differences = won.sum(axis=1) - lost.sum(axis=1)
        # With one difference for each trial the test is McNemar's.
        naive = sign_flip_test(won.astype(np.int64).ravel() - lost.astype(np.int64).ravel())
        alarms += [sign_flip_test(differences) <= 0.05, naive <= 0.05]
    exact, naive = alarms / (2 * RUNS)
    assert exact <= 0.05 + SLACK
    assert (naive > 0.1) == (seeds == 3)
