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


def cell(*won: str) -> Cell:
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
    return measure_gap([Pairs.of(first, second)], np.random.default_rng(0))


# By hand: 1 of 8 is 2 (1 + 8) / 256; 2 of 12 is 2 (1 + 12 + 66) / 4096.


@settings(max_examples=40)
@given(st.lists(st.integers(-3, 3), max_size=10))
def test_the_test_is_what_all_swaps_give(differences):
    """By brute force over all 2^n ways to swap the two of each pair."""
    observed = abs(sum(differences))
    swaps = itertools.product((1, -1), repeat=len(differences))
    as_far = [
        abs(sum(map(math.prod, zip(signs, differences, strict=True)))) >= observed
        for signs in swaps
    ]

    ours = sign_flip_test(np.array(differences, dtype=np.int64))

    assert ours == pytest.approx(sum(as_far) / len(as_far))
    assert sign_flip_test(-7 * np.array(differences, dtype=np.int64)) == pytest.approx(ours)


def test_gap_retention_and_overlap_by_hand():
    implicit = cell("1", "0", "1", "0", "0", "-")
    explicit = cell("1", "1", "0", "1", "0", "1")

    gap = gap_of(implicit, explicit)

    assert (gap.value, gap.retention) == pytest.approx((2 / 5 - 3 / 5, 2 / 3))
    assert (gap.episodes, gap.overlap.discordance) == (5, 0.6)
    assert gap.overlap == Overlap(both=1, only_first=1, only_second=2, neither=1)


def test_a_task_of_one_episode_counts_as_much_as_one_of_18():
    won = Pairs.of(cell("1"), cell("0"))
    lost = Pairs.of(cell(*"0" * 18), cell(*"1" * 18))
    without_pairs = Pairs.of(cell("1"), cell("-"))

    gap = measure_gap([won, lost, without_pairs], np.random.default_rng(0))

    assert (gap.value, gap.episodes) == (0.0, 19)
    assert measure_gap([without_pairs], np.random.default_rng(0)) is None


def test_seeds_are_paired_with_themselves_and_else_by_episode():
    shared = Pairs.of(cell("11-", "0"), cell("-01", "1"))
    assert shared.rows.tolist() == [[1, 1, 0, 1], [0, 1, 1, 1]]

    strangers = Pairs.of(cell("11", "0"), cell("--0", "---1"))
    assert strangers.rows.tolist() == [[2, 2, 0, 1], [0, 1, 1, 1]]
    assert strangers.differences.tolist() == [2, -1]
    assert (strangers.overlap, strangers.overlap.discordance) == (Overlap(0, 0, 0, 0), None)


def test_nothing_is_retained_of_nothing():
    gap = gap_of(cell("0", "1"), cell("0", "0"))
    assert (gap.retention, gap.retention_interval) == (None, None)

    # One success of six: one resample in three has none, and is no bound.
    barely = gap_of(cell(*"100000"), cell(*"100000"))
    assert (barely.retention, *barely.retention_interval) == (1.0, 0.0, math.inf)


def test_resamples_that_are_all_alike_leave_room_for_others():
    """Rates differ from resample to resample; their ratio does not, nor their difference."""
    same = gap_of(cell(*"10" * 20), cell(*"10" * 20))
    low, high = same.retention_interval
    assert low < 0.9
    assert high > 1.1

    tasks = [("0", "1"), ("110", "110"), ("1010010", "1010010")]
    pairs = [Pairs.of(cell(*first), cell(*second)) for first, second in tasks]
    lost = measure_gap(pairs, np.random.default_rng(0))
    low, high = lost.interval

    assert low < -0.5 < lost.value < 0 < high, "but for rounding all are −33.3 points"


def test_episodes_that_are_all_alike_leave_room_for_others():
    same = gap_of(cell(*"1" * 50), cell(*"1" * 50))
    assert same.interval == pytest.approx((-0.07135, 0.07135), abs=1e-5)
    assert same.retention_interval == pytest.approx((0.92865, 1 / 0.92865), abs=1e-4)

    lost = gap_of(cell(*"0" * 50), cell(*"1" * 50))
    assert lost.interval == pytest.approx((-1, -0.8573), abs=1e-4)
    assert lost.p_value == pytest.approx(2 / 2**50)
    assert gap_of(cell("1"), cell("0")).interval is None


@settings(max_examples=30)
@given(st.lists(st.floats(0, 1), min_size=1, max_size=60))
def test_holm_is_that_of_statsmodels(p_values):
    from statsmodels.stats.multitest import multipletests

    assert holm(p_values) == tuple(multipletests(p_values, method="holm")[1].tolist())
