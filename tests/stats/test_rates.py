"""Rates, gaps and p-values as they are printed."""

from decimal import Decimal
from fractions import Fraction

import pytest

from roboirg.stats.rates import mean_percent, p_text, percent, points


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


def test_a_rate_is_rounded_half_up_and_an_average_is_that_of_printed_rates():
    """Two thirds and a half are 58.333… on average, and 58.335 as they are printed."""
    assert percent(Fraction(1, 800)) == Decimal("0.13")

    printed = [percent(Fraction(2, 3)), percent(Fraction(1, 2))]
    assert printed == [Decimal("66.67"), Decimal("50.00")]
    assert mean_percent(printed) == Decimal("58.34")


@pytest.mark.parametrize(
    ("p_value", "text"), [(0.0004, "p < 0.001"), (0.001, "p = 0.001"), (1.0, "p = 1.000")]
)
def test_a_p_value_below_a_thousandth_is_printed_as_such(p_value, text):
    assert p_text(p_value) == text
