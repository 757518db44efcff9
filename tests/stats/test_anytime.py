"""Evidence that holds however often one looked."""

import itertools
import math

import numpy as np
import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from roboirg.stats.anytime import (
    PairedScenes,
    decide,
    mean_bounds,
    p_in_any_order,
    p_path,
    sign_winnings,
    winnings_above,
)

SIGNS = st.lists(st.sampled_from([-1.0, 0.0, 1.0]), min_size=1, max_size=40)


def scenes_of(differences, planned=None):
    """Return scenes of one task with these differences; further planned ones are not known."""
    planned = len(differences) if planned is None else planned
    return PairedScenes(np.array(differences, dtype=np.float64), np.ones(planned))


def test_winnings_on_signs_are_those_of_a_beta_mixture_of_sign_tests():
    """Wins and losses with a chance from Beta(2, 2) have the likelihood B(2+w, 2+l) / B(2, 2).

    Divided by that of a fair coin, after 6 wins and 1 loss this is 2^7 · B(8, 3) / B(2, 2).
    """
    differences = np.array([1, 1, 1, 0, 1, -1, 1, 1], dtype=np.float64)

    winnings = sign_winnings(differences)

    beta_function = math.gamma(8) * math.gamma(3) / math.gamma(11)
    assert winnings[-1] == pytest.approx(2**7 * beta_function * 6, rel=0.01)


def test_ties_change_no_evidence():
    """A scene in which both fail, or both succeed, says nothing of who is better."""
    assert p_path(np.array([1.0, 1.0, 1.0]))[-1] == p_path(np.array([1.0, 0.0, 1.0, 0.0, 1.0]))[-1]


def test_a_p_value_of_any_order_is_that_of_all_scenes_and_not_of_the_best_moment():
    """After 6 wins and 6 losses nothing is won; after the wins alone the p-value was 0.19."""
    wins_first = np.array([1.0] * 6 + [-1.0] * 6)

    assert p_path(wins_first)[-1] < 0.2
    assert p_in_any_order(wins_first) == 1.0
    assert p_in_any_order(np.array([])) == 1.0
    shuffled = np.array([1.0, -1.0, 1.0, 1.0, 1.0])
    assert p_in_any_order(shuffled) == pytest.approx(p_in_any_order(np.sort(shuffled)))


@given(SIGNS)
def test_a_p_value_never_rises_and_is_at_most_one(differences):
    path = p_path(np.array(differences))

    assert path[0] <= 1
    assert (np.diff(path) <= 0).all()


@given(SIGNS)
def test_swapping_the_sides_changes_no_p_value(differences):
    path = p_path(np.array(differences))

    np.testing.assert_allclose(p_path(-np.array(differences)), path)


@given(st.lists(st.sampled_from([-1.0, 1.0]), min_size=3, max_size=9))
def test_nobody_wins_on_average_if_the_sides_can_be_swapped(differences):
    """All choices of signs are equally likely then: over all of them the mean winnings are 1."""
    every = np.array(list(itertools.product([-1.0, 1.0], repeat=len(differences))))

    winnings = sign_winnings(every)[:, -1]

    assert winnings.mean() == pytest.approx(1.0, rel=0.01)


@given(st.lists(st.sampled_from([0.0, 0.5, 1.0]), min_size=2, max_size=6))
def test_nobody_wins_on_average_who_bets_against_the_true_mean(shares):
    """The scenes of a plan come in any order with equal chances: the mean over all orders is 1."""
    orders = np.array(list(itertools.permutations(shares)))

    winnings = winnings_above(float(np.mean(shares)), orders, len(shares))[:, -1]

    assert winnings.mean() == pytest.approx(1.0, rel=1e-6)


@given(SIGNS, st.integers(0, 60))
@example([1.0, -1.0, 1.0], 0)
def test_the_interval_holds_what_the_unknown_scenes_can_make_of_the_mean_so_far(differences, more):
    """It is never outside of what is possible: all scenes that are left lost, or all won.

    When every scene of the plan is known (0 more), it is their mean.
    """
    planned = len(differences) + more

    low, high = mean_bounds(scenes_of(differences, planned))

    known = sum(differences)
    assert (known - more) / planned - 1e-5 <= low <= high <= (known + more) / planned + 1e-5


def test_a_task_of_few_scenes_counts_as_much_as_one_of_many():
    """One task of one scene is won, one of nine is lost in all: the mean over tasks is 0.

    The weight of a scene is 10 / (2 tasks · its task's scenes): 5, and 10/18 nine times.
    """
    weights = np.array([5.0] + 9 * [10 / 18])
    pairs = PairedScenes(np.array([1.0] + 9 * [-1.0]), weights)

    low, high = mean_bounds(pairs)

    assert low == pytest.approx(0, abs=1e-5)
    assert high == pytest.approx(0, abs=1e-5)


def test_equal_sides_are_closed_when_the_difference_is_surely_within_the_margin():
    """After 400 ties of 550 scenes the difference of all can be at most 150/550 = 27 points.

    Bets against 10 points have won before, so the margin of 10 points is enough, and 0 is not.
    """
    tied = scenes_of(400 * [0.0], planned=550)

    assert decide([tied], margin=0.1)[0].finding == "within"
    assert decide([tied], margin=0.0)[0].finding == "open"


def test_a_plan_whose_scenes_are_all_known_is_undecided_and_not_open():
    (decision,) = decide([scenes_of([1.0, -1.0, 0.0])])

    assert decision.finding == "undecided"
    assert decision.places == 3


def test_a_look_waits_for_the_slowest_open_comparison():
    """Of the second comparison one scene is known: of the first, eleven later ones do not count."""
    fast = scenes_of(12 * [1.0], planned=20)
    slow = scenes_of([1.0], planned=20)

    decisions = decide([fast, slow])

    assert [decision.places for decision in decisions] == [1, 1]
    assert [decision.finding for decision in decisions] == ["open", "open"]


def test_two_comparisons_need_more_evidence_than_one():
    """By Holm's rule the first of two is decided at half of the level."""
    clear = scenes_of(30 * [1.0])
    tied = scenes_of(30 * [0.0])

    (alone,) = decide([clear])
    together, _ = decide([clear, tied])

    assert together.scenes > alone.scenes
