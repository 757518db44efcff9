"""Gaps and p-values as they are printed."""

import pytest

from roboirg.stats.rates import p_text, points


@pytest.mark.parametrize(
    ("gap", "decimals", "text"),
    [
        (-0.12, 0, "−12"),
        (0.034, 1, "+3.4"),
        (1.0, 0, "+100"),
        (-1.0, 0, "−100"),
        (0.0, 1, "±0.0"),
        (-0.004, 0, "±0"),
        (0.0004, 1, "±0.0"),
    ],
)
def test_a_gap_has_its_sign_unless_it_is_zero_as_it_is_printed(gap, decimals, text):
    assert points(gap, decimals) == text


def test_a_p_value_is_rounded_half_up():
    """That of five episodes that all fell to one side is 1/16, which Python rounds to 0.062."""
    assert p_text(1 / 16) == "p = 0.063"
