"""Paired comparisons by hand and against libraries."""

from __future__ import annotations

import itertools
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


def cell_of_words(*won: str) -> Cell:
    """A word for each episode, a letter for each seed: 1 won, 0 lost, anything else unplayed."""
    return Cell(
        {
            Trial(episode, seed): letter == "1"
            for episode, letters in enumerate(won)
            for seed, letter in enumerate(letters)
            if letter in "01"
        }
    )


def gap_of(first: Cell, second: Cell):
    return measure_gap([Pairs.of(first, second)])


# By hand: 1 of 8 is 2 (1 + 8) / 256; 2 of 12 is 2 (1 + 12 + 66) / 4096.


@settings(max_examples=40)
@given(st.lists(st.integers(-3, 3), max_size=10))
def test_the_p_value_is_the_share_of_all_sign_flips_that_are_as_extreme(differences):
    """By brute force over all 2^n ways to swap the two results of each pair."""
    observed = abs(sum(differences))
    swaps = itertools.product((1, -1), repeat=len(differences))
    as_far = [
        abs(sum(map(math.prod, zip(signs, differences, strict=True)))) >= observed
        for signs in swaps
    ]

    ours = sign_flip_test(np.array(differences, dtype=np.int64))

    assert ours == pytest.approx(sum(as_far) / len(as_far))
    assert sign_flip_test(-7 * np.array(differences, dtype=np.int64)) == pytest.approx(ours)


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
    """+1 in a task of one episode, -1 in a task of 18: 0. One without a pair does not count."""
    won = Pairs.of(cell_of_words("1"), cell_of_words("0"))
    lost = Pairs.of(cell_of_words(*"0" * 18), cell_of_words(*"1" * 18))
    without_pairs = Pairs.of(cell_of_words("1"), cell_of_words("-"))

    gap = measure_gap([won, lost, without_pairs])

    assert (gap.value, gap.episodes) == (0.0, 19)
    assert measure_gap([without_pairs]) is None


def test_trials_are_paired_by_seed_or_by_episode_if_no_seed_is_common():
    """A word is an episode, a letter a seed: 1 won, 0 lost, - not played.

    A row is won and played of the first policy, then of the second.
    """
    shared = Pairs.of(cell_of_words("11-", "0"), cell_of_words("-01", "1"))
    assert shared.rows.tolist() == [[1, 1, 0, 1], [0, 1, 1, 1]]

    strangers = Pairs.of(cell_of_words("11", "0"), cell_of_words("--0", "---1"))
    assert strangers.rows.tolist() == [[2, 2, 0, 1], [0, 1, 1, 1]]
    assert strangers.differences.tolist() == [2, -1]
    assert (strangers.overlap, strangers.overlap.discordance) == (Overlap(0, 0, 0, 0), None)


def test_retention_is_unknown_if_nothing_was_won_in_explicit():
    """It is a ratio to explicit's rate; if that can be 0 in a resample, it has no upper bound."""
    gap = gap_of(cell_of_words("0", "1"), cell_of_words("0", "0"))
    assert (gap.retention, gap.retention_interval) == (None, None)

    # One success of six in each: the ratio may be anything but 0 and infinite.
    low, high = gap_of(cell_of_words(*"100000"), cell_of_words(*"100000")).retention_interval
    assert low < 0.2
    assert 5 < high < math.inf


def test_a_ratio_that_is_equal_in_all_episodes_still_has_an_interval():
    """Would find an interval of width 0, which looks like certainty."""
    same = gap_of(cell_of_words(*"10" * 20), cell_of_words(*"10" * 20))
    low, high = same.retention_interval
    assert low < 0.9
    assert high > 1.1


def test_a_gap_that_is_equal_in_all_episodes_still_has_an_interval():
    same = gap_of(cell_of_words(*"1" * 50), cell_of_words(*"1" * 50))
    assert same.interval == pytest.approx((-0.0727, 0.0727), abs=1e-4)
    assert gap_of(cell_of_words("1"), cell_of_words("0")).interval is None


@settings(max_examples=30)
@given(st.lists(st.floats(0, 1), min_size=1, max_size=60))
def test_holms_correction_of_p_values_is_that_of_statsmodels(p_values):
    from statsmodels.stats.multitest import multipletests

    assert holm(p_values) == tuple(multipletests(p_values, method="holm")[1].tolist())
