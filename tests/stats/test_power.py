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
def test_power_is_what_the_binomial_gives_by_hand(episodes, gap, discordance, power):
    """Six episodes, all to one side: the test rejects 6 of 6 and 0 of 6 only (p = 1/32)."""
    assert mcnemar_power(episodes, gap, discordance) == pytest.approx(power)


@pytest.mark.parametrize(("episodes", "gap", "discordance"), [(50, 0.2, 0.3), (40, -0.25, 0.5)])
def test_power_is_the_share_of_draws_that_are_rejected(episodes, gap, discordance):
    rng = np.random.default_rng(2)
    first = (discordance + gap) / 2
    second = (discordance - gap) / 2
    draws = rng.multinomial(episodes, [first, second, 1 - discordance], size=4000)
    kinds, counts = np.unique(draws, axis=0, return_counts=True)
    rejected = [
        sign_flip_test(np.repeat([1, -1], [won, lost])) <= 0.05 for won, lost, _ in kinds.tolist()
    ]

    found = counts @ rejected / 4000

    assert mcnemar_power(episodes, gap, discordance) == pytest.approx(found, abs=0.02)


@settings(deadline=None, max_examples=15)
@given(st.floats(0.05, 1), st.floats(0.05, 1))
def test_the_needed_episodes_are_enough_and_half_are_not(share, discordance):
    gap = share * discordance
    needed = episodes_needed(gap, discordance)

    if needed is None:
        assert mcnemar_power(MAX_EPISODES, gap, discordance) < 0.8
        return

    assert mcnemar_power(needed, gap, discordance) >= 0.8
    assert mcnemar_power(max(1, needed // 2), gap, discordance) < 0.8


def test_a_run_has_a_smallest_gap_that_it_can_find():
    gap = smallest_gap(50, 0.3)
    assert mcnemar_power(50, gap, 0.3) >= 0.8 > mcnemar_power(50, gap - 0.001, 0.3)

    nothing = smallest_gap(5, 0.5), episodes_needed(0.0, 0.3), episodes_needed(0.0001, 0.3)
    assert nothing == (None, None, None)
