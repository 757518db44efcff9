"""Intervals by hand, against a library, and by simulation."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from interval_coverage import Design, coverage

from roboirg.stats.cells import Cell, Trial, rate_interval
from roboirg.stats.intervals import (
    Stratum,
    TaskRates,
    critical_value,
    interval_of_values,
    mean_interval,
    ratio_interval,
    share_interval,
)


def rates_of_pairs(*, only_first, only_second, neither, both=0):
    """Return the rates of a task of so many paired episodes with one seed."""
    numbers = (both, only_first, only_second, neither)
    # Successes and trials of the first side, then of the second.
    rows = [[1, 1, 1, 1], [1, 1, 0, 1], [0, 1, 1, 1], [0, 1, 0, 1]]
    return TaskRates.of(np.repeat(rows, numbers, axis=0))


def gap_interval(*, only_first, only_second, neither):
    """Return the interval of the gap between the two sides, for such a task."""
    rates = rates_of_pairs(only_first=only_first, only_second=only_second, neither=neither)
    return mean_interval([rates.combined(1, -1)])


@pytest.mark.parametrize(
    ("alpha", "value"), [(0.05, 1.959964), (0.05 / 12, 2.865)], ids=["one", "one of 12 intervals"]
)
def test_the_critical_value_is_that_of_the_normal_distribution(alpha, value):
    """Two-sided: a share of alpha / 2 of the normal distribution lies beyond it on each side."""
    assert critical_value(alpha) == pytest.approx(value, abs=1e-3)


@pytest.mark.parametrize("trials", [2, 7, 50, 200])
@pytest.mark.parametrize("share", [0.0, 0.1, 0.5, 1.0])
def test_the_interval_of_a_rate_holds_wilsons_of_statsmodels(trials, share):
    """Our interval holds Wilson's; of 50 trials or more its ends are at most 1.2 points away.

    It is longer near 0 and 1, on the side of the edge, and by a degree of freedom (n - 1 for n).
    """
    from statsmodels.stats.proportion import proportion_confint

    successes = round(share * trials)
    low, high = proportion_confint(successes, trials, method="wilson")

    ours = interval_of_values([[1.0] * successes + [0.0] * (trials - successes)])

    assert ours.low <= low + 1e-6
    assert ours.high >= high - 1e-6
    if trials >= 50:
        assert ours == pytest.approx((low, high), abs=0.012)


def test_two_solved_of_50_may_be_a_rate_of_one_percent():
    """Wilson's interval begins at 1.1 %; of 100 such runs at 1 %, it missed the rate in nine."""
    low, _ = interval_of_values([[1.0] * 2 + [0.0] * 48])
    assert 0.006 < low < 0.008


def tango_statistic(gap, *, only_first, only_second, episodes):
    """Return how many standard errors a gap of two paired rates is from the observed one.

    As in Tango, Statistics in Medicine 17 (1998), but with a degree of freedom less.
    """
    # The share that only the second solves, most likely if the gap is the true one.
    linear = (2 * episodes - only_first + only_second) * gap - (only_first + only_second)
    constant = -2 * gap * (1 - gap)
    share = (np.sqrt(linear**2 - 8 * episodes * constant) - linear) / (4 * episodes)
    variance = episodes * (2 * share + gap * (1 - gap)) * episodes / (episodes - 1)
    return abs(only_first - only_second - episodes * gap) / np.sqrt(variance)


def test_the_interval_of_a_gap_is_tangos_but_for_a_degree_of_freedom():
    """Of 20 episodes, 6 are solved by the first side alone and 2 by the second alone. Tango's score
    interval of 95 % ends where his statistic is 1.96, the normal distribution's value. Ours ends
    there, or further out by up to 0.2 where the outcomes are skewed; it is never shorter."""
    interval = gap_interval(only_first=6, only_second=2, neither=12)

    at_ends = [tango_statistic(end, only_first=6, only_second=2, episodes=20) for end in interval]

    assert 1.959 <= min(at_ends) <= max(at_ends) < 2.16


@pytest.mark.parametrize(
    ("only_second", "neither", "interval"),
    [(0, 50, (-0.0727, 0.0727)), (50, 0, (-1, -1 + 2 * 0.0727))],
    ids=["all lost by both", "all won by the second alone"],
)
def test_gaps_of_episodes_that_all_ended_alike_have_an_interval_of_their_number(
    only_second, neither, interval
):
    """Resamples would all be 0. Of 50 up to z² / (49 + z²) = 3.8415 / 52.84 may differ."""
    found = gap_interval(only_first=0, only_second=only_second, neither=neither)
    assert found == pytest.approx(interval, abs=1e-4)


def test_an_interval_over_four_equal_tasks_is_about_half_as_long():
    """The mean over four tasks of 50 episodes each has 1 / sqrt(4) of the standard error of one.

    A little less, 0.44 to 0.5, as the interval of few episodes is longer than the normal one.
    """
    task = rates_of_pairs(only_first=6, only_second=2, neither=42)

    single = mean_interval([task.combined(1, -1)])
    four = mean_interval([task.combined(1 / 4, -1 / 4)] * 4)

    assert 0.44 < (four.high - four.low) / (single.high - single.low) < 0.5


@pytest.mark.parametrize("seeds", [1, 3])
def test_trials_of_one_episode_count_as_one(seeds):
    """50 episodes with three seeds that always agree have the interval of 50, not of 150.

    The first ten episodes are won.
    """
    cell = Cell({Trial(number, seed): number < 10 for number in range(50) for seed in range(seeds)})
    assert rate_interval([cell]) == pytest.approx((0.1062, 0.3318), abs=1e-4)


def test_an_episode_with_more_trials_weighs_more():
    """A rate is successes by trials: 3 of 3 and 0 of 1 are 3/4, so its interval is around that."""
    stratum = TaskRates.of(np.array([[3, 3], [0, 1]])).combined(1)

    assert stratum.mean == pytest.approx(0.75)
    assert stratum.episodes == pytest.approx(1 / (0.75**2 + 0.25**2))


def test_no_gap_reaches_beyond_100_points_if_one_side_has_more_trials_of_an_episode():
    """A row is an episode: trials won and played by the first side, then by the second."""
    rows = np.array([[3, 3, 0, 1], [1, 1, 0, 3], [1, 2, 0, 1]])
    low, high = mean_interval([TaskRates.of(rows).combined(1, -1)])
    assert -1 <= low < high <= 1


ONE_EPISODE_WITH_THREE_SEEDS = Cell({Trial(0, seed): True for seed in range(3)})


@pytest.mark.parametrize(
    "cells",
    [
        [ONE_EPISODE_WITH_THREE_SEEDS],
        [Cell()],
        [ONE_EPISODE_WITH_THREE_SEEDS, ONE_EPISODE_WITH_THREE_SEEDS],
    ],
    ids=["one episode", "none", "as many episodes as tasks"],
)
def test_one_episode_or_none_has_no_interval(cells):
    assert rate_interval(cells) is None


def test_the_interval_of_a_ratio_ends_where_the_weighted_difference_may_just_be_0():
    """Of 50 episodes the first side solves 9 + 3 and the second 9 + 12: the ratio is 12/21. Another
    ratio r may be the true one as long as the first rate less r times the second, which is
    `combined(1, -r)`, may be 0: at an end of the ratio's interval, the interval of that difference
    begins or ends at 0."""
    rates = rates_of_pairs(both=9, only_first=3, only_second=12, neither=26)

    low, high = ratio_interval([rates])

    assert low < 12 / 21 < high
    assert mean_interval([rates.combined(1, -low)]).low == pytest.approx(0, abs=1e-4)
    assert mean_interval([rates.combined(1, -high)]).high == pytest.approx(0, abs=1e-4)


def test_values_between_other_bounds_have_the_interval_scaled():
    """Ratings from 1 to 5 are shares from 0 to 1, times 4 and plus 1."""
    shares = interval_of_values([[0.75, 1.0, 0.875, 1.0]])

    ratings = interval_of_values([[4.0, 5.0, 4.5, 5.0]], 1.0, 5.0)

    assert ratings == pytest.approx((1 + 4 * shares.low, 1 + 4 * shares.high), abs=1e-5)


@settings(max_examples=50)
@given(st.lists(st.sampled_from([-1.0, -0.5, 0.0, 0.5, 1.0]), min_size=2, max_size=40))
def test_every_interval_holds_its_mean_has_a_length_and_stays_between_the_bounds(values):
    """For 2 to 40 values between -1 and 1, even if all are equal; 40 equal ones are not certain."""
    low, high = mean_interval([Stratum.of(values, -1.0, 1.0)])

    assert -1 <= low <= np.mean(values) + 1e-9
    assert np.mean(values) - 1e-9 <= high <= 1
    assert high - low > 0.05


@pytest.mark.parametrize(
    ("design", "rates", "correlation"),
    [
        (Design("one task", episodes=[50], seeds=1), (0.02, 0.04), 0.0),
        (Design("three seeds", episodes=[20], seeds=3), (0.01, 0.01), 0.9),
        (Design("unequal tasks", episodes=[5, 30], seeds=1), (0.98, 0.99), 0.5),
        (Design("the middle", episodes=[20, 20], seeds=1), (0.3, 0.5), 0.5),
    ],
    ids=lambda design: getattr(design, "name", ""),
)
def test_intervals_of_rate_gap_and_retention_hold_the_truth_at_the_edge(design, rates, correlation):
    """Of 300 simulated runs at least 93 % have the true value in their interval of 95 %.

    Resamples covered a gap of 2 % against 4 % in 85. `rates` are the true ones of both sides,
    `correlation` that of their outcomes in an episode. Would find intervals too short near 0 and 1.
    """
    shares = coverage(design, rates, correlation, simulations=300)
    assert min(shares.values()) >= 0.93


def three_rates(*, rewritten, said, explicit, episodes=40):
    """Return the rates of a task in which each of three solves the first so many episodes.

    The three are how an instruction is told: as said, rewritten, and as an explicit command.
    """
    numbers = np.arange(episodes)
    rows = np.ones((episodes, 6), dtype=np.int64)
    rows[:, 0] = numbers < rewritten
    rows[:, 2] = numbers < said
    rows[:, 4] = numbers < explicit
    return TaskRates.of(rows)


@pytest.mark.parametrize(
    ("rewritten", "share"), [(10, 0.0), (20, 0.5), (30, 1.0), (0, -0.5)], ids=str
)
def test_the_interval_of_a_share_holds_the_share_as_measured(rewritten, share):
    """Of 40 episodes 10 are solved as said and 30 if explicit: there are 20 to gain.

    Of these, a rewriter that solves 20 gains 10, a share of 0.5; one that solves none has -0.5.
    """
    interval = share_interval([three_rates(rewritten=rewritten, said=10, explicit=30)])

    assert interval.low < share < interval.high


@pytest.mark.parametrize(("said", "explicit"), [(20, 21), (21, 20)])
def test_there_is_no_share_of_a_gap_that_may_be_none(said, explicit):
    """Of 40 episodes; one more or less may be chance."""
    assert share_interval([three_rates(rewritten=20, said=said, explicit=explicit)]) is None


def test_more_episodes_give_a_shorter_interval_of_a_share():
    """The same rates of 40 and of 400 episodes: 1 / sqrt(10) is less than half."""
    few = share_interval([three_rates(rewritten=20, said=10, explicit=30)])
    many = share_interval([three_rates(rewritten=200, said=100, explicit=300, episodes=400)])

    assert many.high - many.low < (few.high - few.low) / 2


def simulated_rates(rng, *, rewritten, said, explicit):
    """Return the rates of 50 simulated episodes of a task, if the true rates are these.

    The episodes differ in ease: what is solved in one way is likelier to be so in the others.
    """
    ease = (rng.random((50, 1)) + rng.random((50, 3))) / 2
    # The mean of two uniform numbers is below such a limit, of 0.5 or more, at the given rate.
    limits = 1 - np.sqrt((1 - np.array([rewritten, said, explicit])) / 2)
    rows = np.ones((50, 6), dtype=np.int64)  # successes and trials of the first way, and so on
    rows[:, [0, 2, 4]] = ease < limits
    return TaskRates.of(rows)


def test_the_interval_of_a_share_holds_the_true_one_in_most_simulated_runs():
    """Instructions are solved at 60 % as said, at 72 % rewritten and at 90 % as explicit commands:
    rewriting gains 12 of 30 points, a share of 0.4. An interval of 95 % should hold it in about 95
    of 100 runs; 90 allow for chance, and for runs with too small a gap for an interval."""
    rng = np.random.default_rng(seed=3)

    runs_that_hold_it = 0
    for _ in range(150):
        interval = share_interval([simulated_rates(rng, rewritten=0.72, said=0.6, explicit=0.9)])
        if interval is not None and interval.low <= 0.4 <= interval.high:
            runs_that_hold_it += 1

    assert runs_that_hold_it / 150 >= 0.9
