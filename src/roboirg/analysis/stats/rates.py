"""Rates as they are printed: percent with two decimals, and averages of what is printed.

The rule is the one that gives all published averages to the last digit: a cell is rounded half up,
and an average is the mean of the rounded cells, again rounded half up. Means of the unrounded rates
differ in the last digit in six of the published averages.
"""

from __future__ import annotations

from collections.abc import Sequence
from decimal import ROUND_HALF_UP, Decimal
from fractions import Fraction
from typing import Literal

DIGITS = Decimal("0.01")

Change = Literal["up", "down", "same"]


def percent(rate: Fraction) -> Decimal:
    """A rate from 0 to 1 in percent with two decimals, rounded half up."""
    return _rounded(100 * rate)


def mean_percent(cells: Sequence[Decimal]) -> Decimal:
    """The unweighted mean of printed rates, printed by the same rule."""
    return _rounded(sum(map(Fraction, cells), Fraction(0)) / len(cells))


def change(value: Decimal, reference: Decimal) -> Change:
    """Whether a printed rate is above or below another, or the same."""
    return "same" if value == reference else "up" if value > reference else "down"


def _rounded(value: Fraction) -> Decimal:
    # Two decimals more than enough of an exact quotient would be rounded twice; so in integers.
    hundredths = (200 * value.numerator + value.denominator) // (2 * value.denominator)
    return (Decimal(hundredths) * DIGITS).quantize(DIGITS, ROUND_HALF_UP)
