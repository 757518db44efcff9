"""Power by hand, by simulation, and there and back."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from roboirg.stats.paired_tests import sign_flip_test
from roboirg.stats.power import (
    MAX_EPISODES,
    episodes_needed,
    mcnemar_power,
    smallest_gap,
)


@pytest.mark.parametrize(
    ("episodes", "gap", "discordance", "power"),
    [
        (6, 1.0, 1.0, 1.0),
        (5, 1.0, 1.0, 0.0),
        (6, 0.5, 1.0, 0.75**6 + 0.25**6),  # shares 3/4 and 1/4
        (6, 0.5, 0.5, 0.5**6),
        (6, 0.0, 0.0, 0.0),
    ],
)
def test_the_chance_to_find_a_gap_in_six_episodes_is_the_one_computed_by_hand(
    episodes, gap, discordance, power
):
    """Of six episodes all must differ to one side (p = 2 / 2^6 = 1/32); five can never do (1/16).

    `discordance` is the share of episodes that differ at all. With a gap of 0.5 and discordance 1,
    an episode goes to one side with 3/4 and to the other with 1/4; with discordance 0.5 all go to
    one side, if they differ.
    """
    assert mcnemar_power(episodes, gap, discordance) == pytest.approx(power)


@pytest.mark.parametrize(("episodes", "gap", "discordance"), [(50, 0.2, 0.3), (40, -0.25, 0.5)])
def test_the_computed_power_is_the_share_of_simulated_studies_that_find_the_gap(
    episodes, gap, discordance
):
    """4,000 studies are drawn; a study finds the gap if its p-value is at most 0.05.

    An episode is won by the first policy alone, by the second alone, or ends alike.
    """
    rng = np.random.default_rng(2)
    shares = [(discordance + gap) / 2, (discordance - gap) / 2, 1 - discordance]
    studies = rng.multinomial(episodes, shares, size=4000)

    finding = 0
    for (won, lost, _), count in zip(*np.unique(studies, axis=0, return_counts=True), strict=True):
        if sign_flip_test(np.repeat([1, -1], [won, lost])) <= 0.05:
            finding += count

    assert mcnemar_power(episodes, gap, discordance) == pytest.approx(finding / 4000, abs=0.02)


@settings(deadline=None, max_examples=15)
@given(share=st.floats(0.05, 1), discordance=st.floats(0.05, 1))
def test_the_number_of_episodes_given_for_a_gap_finds_it_in_80_percent_and_half_does_not(
    share, discordance
):
    """For any gap: the power is 0.8 or more with the number that is given, less with half of it.

    If none is given, even `MAX_EPISODES` do not find the gap.
    """
    gap = share * discordance

    needed = episodes_needed(gap, discordance)

    if needed is None:
        assert mcnemar_power(MAX_EPISODES, gap, discordance) < 0.8
        return
    assert mcnemar_power(needed, gap, discordance) >= 0.8
    assert mcnemar_power(max(1, needed // 2), gap, discordance) < 0.8


@pytest.mark.parametrize("gap", [1.0, -1.0])
def test_six_episodes_find_that_one_policy_solves_all_and_the_other_none(gap):
    """Five cannot, whichever of the two it is."""
    assert episodes_needed(gap, 1.0) == 6


def test_the_smallest_gap_that_50_episodes_can_find_is_exact_to_a_thousandth():
    """*Find* is at least 80 % power."""
    gap = smallest_gap(50, discordance=0.3)
    assert mcnemar_power(50, gap, 0.3) >= 0.8 > mcnemar_power(50, gap - 0.001, 0.3)


def test_five_episodes_find_no_gap():
    """If all five go to one side, p is still 2 / 2^5 = 0.0625, above 0.05."""
    assert smallest_gap(5, discordance=0.5) is None


@pytest.mark.parametrize("gap", [0.0, 0.0001])
def test_no_number_of_episodes_finds_a_gap_of_nearly_0(gap):
    """30 % of episodes differ; a gap of 0.01 points takes more than the most episodes."""
    assert episodes_needed(gap, discordance=0.3) is None
