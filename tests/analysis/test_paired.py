"""Paired comparisons by hand and against libraries."""

from __future__ import annotations

import itertools
import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from roboirg.evaluation.analysis.stats.cells import CellResults, Trial
from roboirg.evaluation.analysis.stats.paired_tests import (
    Overlap,
    Pairs,
    holm,
    measure_gap,
    sign_flip_test,
)


def cell(*won: str) -> CellResults:
    """A word for each episode, a letter for each seed: 1 won, 0 lost, anything else unplayed."""
    return CellResults(
        {
            Trial(episode, seed): letter == "1"
            for episode, letters in enumerate(won)
            for seed, letter in enumerate(letters)
            if letter in "01"
        }
    )


def gap_of(first: CellResults, second: CellResults):
    return measure_gap([Pairs.of(first, second)], np.random.default_rng(0))


# By hand: 1 of 8 is 2 (1 + 8) / 256; 2 of 12 is 2 (1 + 12 + 66) / 4096.
@pytest.mark.parametrize(
    ("only_first", "only_second", "p_value"),
    [(1, 7, 18 / 256), (2, 10, 158 / 4096), (5, 5, 1.0), (0, 0, 1.0), (6, 0, 2 / 64)],
)
def test_mcnemar(only_first: int, only_second: int, p_value: float) -> None:
    differences = np.array([1] * only_first + [-1] * only_second + [0] * 5)
    assert sign_flip_test(differences) == pytest.approx(p_value)


@given(st.integers(0, 60), st.integers(0, 60))
def test_mcnemar_is_that_of_statsmodels(only_first: int, only_second: int) -> None:
    from statsmodels.stats.contingency_tables import mcnemar

    theirs = mcnemar([[0, only_first], [only_second, 0]], exact=True).pvalue
    ours = sign_flip_test(np.array([1] * only_first + [-1] * only_second))
    assert ours == pytest.approx(min(1.0, theirs), abs=1e-12)


@given(st.lists(st.integers(-3, 3), max_size=10))
def test_the_test_is_what_all_swaps_give(differences: list[int]) -> None:
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


def test_gap_retention_and_overlap_by_hand() -> None:
    implicit, explicit = cell("1", "0", "1", "0", "0", "-"), cell("1", "1", "0", "1", "0", "1")
    gap = gap_of(implicit, explicit)
    assert gap.value == pytest.approx(2 / 5 - 3 / 5)
    assert gap.retention == pytest.approx(2 / 3)
    assert gap.episodes == 5
    assert gap.overlap == Overlap(both=1, only_first=1, only_second=2, neither=1)
    assert gap.overlap.discordance == 0.6
    assert gap.p_value == pytest.approx(1.0)  # 1 of 3: 2 (1 + 3) / 8


def test_seeds_are_paired_with_themselves_and_else_by_episode() -> None:
    shared = Pairs.of(cell("11-", "0"), cell("-01", "1"))
    assert shared.rows.tolist() == [[1, 1, 0, 1], [0, 1, 1, 1]]
    strangers = Pairs.of(cell("11", "0"), cell("--0", "---1"))
    assert strangers.rows.tolist() == [[2, 2, 0, 1], [0, 1, 1, 1]]
    assert strangers.overlap == Overlap(0, 0, 0, 0)
    assert strangers.differences.tolist() == [2, -1]
    assert strangers.overlap.discordance is None


def test_several_tasks_count_alike() -> None:
    good = Pairs.of(cell("1", "1"), cell("0", "0"))
    bad = Pairs.of(cell(*"0" * 18), cell(*"1" * 18))
    gap = measure_gap([good, bad], np.random.default_rng(0))
    assert gap.value == 0.0
    assert gap.episodes == 20
    empty = Pairs.of(cell("1"), cell("-"))
    assert measure_gap([good, empty], np.random.default_rng(0)).value == 1.0
    assert measure_gap([empty], np.random.default_rng(0)) is None


def test_nothing_is_retained_of_nothing() -> None:
    gap = gap_of(cell("0", "1"), cell("0", "0"))
    assert (gap.retention, gap.retention_interval) == (None, None)
    # One success of six: one resample in three has none, and is no bound.
    barely = gap_of(cell(*"100000"), cell(*"100000"))
    assert barely.retention == 1.0
    assert barely.retention_interval.low == 0.0
    assert barely.retention_interval.high == math.inf


def test_episodes_that_are_all_alike_leave_room_for_others() -> None:
    same = gap_of(cell(*"1" * 50), cell(*"1" * 50))
    assert same.interval == pytest.approx((-0.07135, 0.07135), abs=1e-5)
    assert same.retention_interval == pytest.approx((0.92865, 1 / 0.92865), abs=1e-4)
    lost = gap_of(cell(*"0" * 50), cell(*"1" * 50))
    assert lost.interval == pytest.approx((-1, -0.8573), abs=1e-4)
    assert lost.p_value == pytest.approx(2 / 2**50)
    assert gap_of(cell("1"), cell("0")).interval is None


@pytest.mark.slow
@given(st.lists(st.floats(0, 1), min_size=1, max_size=60))
def test_holm_is_that_of_statsmodels(p_values: list[float]) -> None:
    from statsmodels.stats.multitest import multipletests

    assert holm(p_values) == tuple(multipletests(p_values, method="holm")[1].tolist())


def test_holm_by_hand() -> None:
    """0.01 · 4; then at least that: 0.02 · 3, 0.03 · 2 (raised to 0.06), 0.5 · 1."""
    assert holm([0.03, 0.5, 0.01, 0.02]) == pytest.approx((0.06, 0.5, 0.04, 0.06))
    assert holm([]) == ()
    assert holm([0.7, 0.9]) == pytest.approx((1.0, 1.0))


def test_holm_rejects_what_stepping_down_rejects() -> None:
    """Against the procedure itself: compare the smallest with 0.05 / n, the next with less."""
    rng = np.random.default_rng(1)
    for family in (rng.random((10, 12)) ** 4).tolist():
        rejected, threshold = set(), len(family)
        for p_value, index in sorted((p_value, index) for index, p_value in enumerate(family)):
            if p_value > 0.05 / threshold:
                break
            rejected.add(index)
            threshold -= 1
        assert {index for index, value in enumerate(holm(family)) if value <= 0.05} == rejected
