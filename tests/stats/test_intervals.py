"""Intervals by hand, against libraries, and by simulation."""

from __future__ import annotations

import os

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from roboirg.stats.cells import (
    Cell,
    Trial,
    cell_interval,
    clustered_interval,
)
from roboirg.stats.intervals import (
    resampled_rates,
    wilson_interval,
)
from roboirg.stats.paired_tests import Pairs, measure_gap

LONG = "ROBOIRG_LONG_TESTS" in os.environ
"""Ten times as many simulated runs."""
SIMULATIONS = 6000 if LONG else 300
RESAMPLES = 1000
NOMINAL = (0.93, 0.97)
SLACK = 2.6 * np.sqrt(0.05 * 0.95 / SIMULATIONS)
"""What chance alone does to a simulated share, in 99 of 100 cases."""


def cell_of_verdicts(won: np.ndarray) -> Cell:
    """Of an array (episodes, seeds)."""
    return Cell(
        {
            Trial(episode, seed): bool(value)
            for episode, row in enumerate(won)
            for seed, value in enumerate(row)
        }
    )


def simulated_verdicts(
    rng: np.random.Generator, rate: float, episodes: int, seeds: int, correlation: float
) -> np.ndarray:
    """Verdicts whose correlation between the seeds of an episode is `correlation`."""
    chances = np.full(episodes, rate)
    if correlation:
        spread = 1 / correlation - 1
        chances = rng.beta(rate * spread, (1 - rate) * spread, size=episodes)
    return rng.random((episodes, seeds)) < chances[:, None]


def is_about_95_percent(share: float) -> bool:
    return NOMINAL[0] - SLACK <= share <= NOMINAL[1] + SLACK


@settings(max_examples=30)
@given(st.integers(1, 400).flatmap(lambda n: st.tuples(st.integers(0, n), st.just(n))))
def test_wilsons_interval_of_a_rate_is_that_of_statsmodels(counts):
    from statsmodels.stats.proportion import proportion_confint

    theirs = proportion_confint(*counts, method="wilson")
    assert wilson_interval(*counts) == pytest.approx(theirs, abs=1e-12)


def test_resampling_draws_whole_episodes_with_all_of_their_trials():
    """Episode A won 1 of 1 trials, B 0 of 3: the resamples AA, AB, BA, BB have 1, 1/4, 1/4, 0.

    With a second task, in which all 90 episodes are lost, the mean over tasks is half of that.
    """
    rows = np.array([[1, 1], [0, 3]])
    lost = np.array([[0, 1]] * 90)
    for tasks, ends in (([rows], [0.0, 0.25, 1.0]), ([rows, lost], [0.0, 0.125, 0.5])):
        drawn = resampled_rates(tasks, np.random.default_rng(1), 40_000)[:, 0]
        values, counts = np.unique(drawn, return_counts=True)
        assert values.tolist() == ends
        assert counts / 40_000 == pytest.approx([0.25, 0.5, 0.25], abs=0.01)


def test_an_interval_is_wilsons_with_one_trial_an_episode_and_else_resamples_episodes():
    """Trials of one episode resemble each other; Wilson's would take them for independent."""
    rng = np.random.default_rng(2)
    once, thrice = (
        cell_of_verdicts(simulated_verdicts(rng, 0.4, 50, seeds, 0.5)) for seeds in (1, 3)
    )

    assert cell_interval(once, rng) == wilson_interval(once.counts.successes, 50)
    theirs = clustered_interval([thrice], np.random.default_rng(0))
    assert cell_interval(thrice, np.random.default_rng(0)) == theirs


def test_episodes_that_are_all_lost_have_wilsons_interval_of_their_number():
    """Resamples would all be 0. Of 50 lost, up to z² / (50 + z²) = 3.8415 / 53.8415 may be won.

    Would find an interval of width 0, or one of the 150 trials, which is narrower.
    """
    lost = cell_of_verdicts(np.zeros((50, 3), dtype=bool))
    assert cell_interval(lost, np.random.default_rng(2)) == pytest.approx((0, 0.07135), abs=1e-5)


def test_one_episode_or_none_has_no_interval():
    rng = np.random.default_rng(2)
    once = cell_of_verdicts(simulated_verdicts(rng, 0.4, 50, 1, 0.5))
    single = cell_of_verdicts(np.ones((1, 3), dtype=bool))

    assert clustered_interval([single], rng) is None
    assert clustered_interval([once, Cell()], rng) is None
    assert cell_interval(Cell(), rng) is None


@pytest.mark.parametrize(("rate", "correlation"), [(0.3, 0.5), (0.5, 0.0), (0.8, 0.5)])
def test_the_interval_over_episodes_contains_the_true_rate_in_95_of_100_simulations(
    rate, correlation
):
    """50 episodes, 3 trials each, whose correlation is `correlation`.

    Would find an interval that takes these trials for independent: it would be too narrow.
    """
    rng = np.random.default_rng(11)
    hits = 0

    for _ in range(SIMULATIONS):
        interval = clustered_interval(
            [cell_of_verdicts(simulated_verdicts(rng, rate, 50, 3, correlation))], rng, RESAMPLES
        )
        hits += interval is not None and interval.low <= rate <= interval.high

    assert is_about_95_percent(hits / SIMULATIONS)


@pytest.mark.parametrize("seeds", [1, 3])
def test_intervals_of_gap_and_retention_contain_the_truth_in_95_of_100_simulations(seeds):
    """Implicit wins at 0.6 times the rate of explicit, 0.5: retention 0.6, gap -0.2."""
    rng = np.random.default_rng(13)
    gap_hits = 0
    retention_hits = 0
    for _ in range(SIMULATIONS):
        ease = rng.beta(2, 2, size=(50, 1))
        second, first = (
            cell_of_verdicts(rng.random((50, seeds)) < share * ease) for share in (1, 0.6)
        )
        gap = measure_gap([Pairs.of(first, second)], rng, RESAMPLES)
        gap_hits += contains(gap.interval, -0.2)
        retention_hits += contains(gap.retention_interval, 0.6)

    assert is_about_95_percent(gap_hits / SIMULATIONS)
    assert is_about_95_percent(retention_hits / SIMULATIONS)


def contains(interval, true):
    return interval is not None and interval.low <= true <= interval.high
