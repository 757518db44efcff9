"""Paired comparisons by hand and against libraries."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from roboirg.stats.cells import Cell, Trial
from roboirg.stats.paired_tests import (
    Overlap,
    Pairs,
    holm,
    measure_gap,
    sign_flip_test,
)


def cell_of_words(*episodes):
    """Return the trials of a cell: a word for each episode, in it a letter for each seed.

    1 is won, 0 lost, anything else unplayed: ``cell_of_words("10", "-1")`` has two trials of the
    first episode and one of the second.
    """
    trials = {}
    for episode, letters in enumerate(episodes):
        for seed, letter in enumerate(letters):
            if letter in "01":
                trials[Trial(episode, seed)] = letter == "1"
    return Cell(trials)


def gap_of(first, second):
    """Return the gap between two cells of one task."""
    return measure_gap([Pairs.of(first, second)])


@pytest.mark.parametrize(
    ("differences", "p_value"),
    [
        ([-1] + [1] * 7, 2 * (1 + 8) / 2**8),
        ([-1] * 2 + [1] * 10, 2 * (1 + 12 + 66) / 2**12),
        ([3, 1], 2 / 4),
        ([0, 0], 1.0),
        ([], 1.0),
    ],
)
def test_the_p_value_is_the_share_of_all_sign_flips_that_are_as_extreme(differences, p_value):
    """One of 8 pairs differs to the other side: of 2^8 flips 1 + 8 are as far to each side."""
    assert sign_flip_test(np.array(differences, dtype=np.int64)) == pytest.approx(p_value)


@settings(max_examples=40)
@given(st.lists(st.integers(-3, 3), max_size=10))
def test_the_p_value_depends_neither_on_the_sign_nor_on_the_unit_of_the_differences(differences):
    values = np.array(differences, dtype=np.int64)
    assert sign_flip_test(-7 * values) == pytest.approx(sign_flip_test(values))


def test_gap_and_retention_are_over_the_episodes_that_both_have():
    """1 is won, 0 lost, - not played: implicit wins 2 and explicit 3 of the five in common.

    The gap is the difference of rates, retention their ratio, discordance the share that differs.
    """
    implicit = cell_of_words("1", "0", "1", "0", "0", "-")
    explicit = cell_of_words("1", "1", "0", "1", "0", "1")

    gap = gap_of(implicit, explicit)

    assert (gap.value, gap.retention) == pytest.approx((2 / 5 - 3 / 5, 2 / 3))
    assert (gap.episodes, gap.overlap.discordance) == (5, 0.6)
    assert gap.overlap == Overlap(both=1, only_first=1, only_second=2, neither=1)


def test_a_gap_over_tasks_weighs_them_equally_whatever_their_number_of_episodes():
    """+1 in a task of one episode, −1 in a task of 18: 0."""
    won = Pairs.of(cell_of_words("1"), cell_of_words("0"))
    lost = Pairs.of(cell_of_words(*"0" * 18), cell_of_words(*"1" * 18))

    gap = measure_gap([won, lost])

    assert (gap.value, gap.episodes) == (0.0, 19)


def test_a_task_without_a_pair_of_trials_does_not_count_in_a_gap():
    won = Pairs.of(cell_of_words("1"), cell_of_words("0"))
    without_pairs = Pairs.of(cell_of_words("1"), cell_of_words("-"))

    assert measure_gap([won, without_pairs]).value == 1.0
    assert measure_gap([without_pairs]) is None


def test_trials_are_paired_by_seed_or_by_episode_if_no_seed_is_common():
    """A row has won and played of the first policy, then of the second.

    Seed 1 is common in the first case; in the second, where none is, all seeds count.
    """
    by_seed = Pairs.of(cell_of_words("11-", "0"), cell_of_words("-01", "1"))
    by_episode = Pairs.of(cell_of_words("11", "0"), cell_of_words("--0", "---1"))

    assert by_seed.rows.tolist() == [[1, 1, 0, 1], [0, 1, 1, 1]]
    assert by_episode.rows.tolist() == [[2, 2, 0, 1], [0, 1, 1, 1]]


def test_trials_paired_by_episode_have_differences_but_no_discordance():
    pairs = Pairs.of(cell_of_words("11", "0"), cell_of_words("--0", "---1"))

    assert pairs.differences.tolist() == [2, -1]
    assert pairs.overlap == Overlap(both=0, only_first=0, only_second=0, neither=0)
    assert pairs.overlap.discordance is None


def test_retention_is_unknown_if_nothing_was_won_in_explicit():
    """It is a ratio to explicit's rate."""
    gap = gap_of(cell_of_words("0", "1"), cell_of_words("0", "0"))

    assert gap.retention is None
    assert gap.retention_interval is None


def test_retention_may_be_nearly_anything_if_explicit_may_be_0():
    """One success of six in each: anything but 0 and infinite."""
    gap = gap_of(cell_of_words(*"100000"), cell_of_words(*"100000"))

    low, high = gap.retention_interval

    assert low < 0.2
    assert 5 < high < math.inf


def test_a_ratio_that_is_equal_in_all_episodes_still_has_an_interval():
    """Would find an interval of width 0, which looks like certainty."""
    half_won = cell_of_words(*"10" * 20)

    low, high = gap_of(half_won, half_won).retention_interval

    assert low < 0.9
    assert high > 1.1


def test_a_gap_that_is_equal_in_all_episodes_still_has_an_interval():
    """Of 50 episodes up to 7.27 % may differ; see test_intervals.py."""
    all_won = cell_of_words(*"1" * 50)
    assert gap_of(all_won, all_won).interval == pytest.approx((-0.0727, 0.0727), abs=1e-4)


def test_a_gap_of_one_episode_has_no_interval():
    assert gap_of(cell_of_words("1"), cell_of_words("0")).interval is None


@settings(max_examples=30)
@given(st.lists(st.floats(0, 1), min_size=1, max_size=60))
def test_holms_correction_of_p_values_is_that_of_statsmodels(p_values):
    from statsmodels.stats.multitest import multipletests

    assert holm(p_values) == tuple(multipletests(p_values, method="holm")[1].tolist())
