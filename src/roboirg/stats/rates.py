"""Printed rates and gaps, and averages of printed rates.

In tables of the paper a cell is rounded half up to two decimals, and an average is the mean of the
rounded cells, again rounded half up. This rule gives every published average to the last digit;
means of the unrounded rates differ in the last digit in six of them.
"""

from __future__ import annotations

from collections.abc import Sequence
from decimal import ROUND_HALF_UP, Decimal
from fractions import Fraction
from typing import NamedTuple

from roboirg.core.plain_text import counted
from roboirg.stats.anytime import PairedScenes
from roboirg.stats.intervals import TOO_FEW, Interval
from roboirg.stats.paired_tests import Gap

NOT_APPLICABLE = "–"
DIGITS = Decimal("0.01")

_SMALLEST_P = 0.001


def percent(rate: Fraction) -> Decimal:
    """Return a rate from 0 to 1 in percent with two decimals, rounded half up."""
    return _rounded(100 * rate)


def mean_percent(cells: Sequence[Decimal]) -> Decimal:
    """Return the unweighted mean of printed rates, rounded by the same rule."""
    total = sum((Fraction(cell) for cell in cells), Fraction(0))
    return _rounded(total / len(cells))


def change_text(change: Decimal) -> str:
    """Return the difference of two printed rates with an arrow: ``↑1.33``, ``→0.00``."""
    arrow = "→"
    if change > 0:
        arrow = "↑"
    elif change < 0:
        arrow = "↓"
    return f"{arrow}{abs(change)}"


def whole_percent(rate: float | Fraction) -> str:
    """Return a rate from 0 to 1 as a whole percentage, rounded half up: 1/8 becomes 13."""
    return str(half_up(100 * float(rate), 0))


def percent_range(low: Fraction, high: Fraction) -> str:
    """Return two rates as whole percentages, one if they are equal then: ``3–7``."""
    low_text = whole_percent(low)
    high_text = whole_percent(high)
    return low_text if low_text == high_text else f"{low_text}–{high_text}"


def points(gap: float, decimals: int = 0) -> str:
    """Return a gap, -1 to 1, in signed percentage points: ``−12``, ``+3``, ``±0``."""
    text = f"{half_up(100 * gap, decimals):+}".replace("-", "−")  # the typographic minus
    is_zero = not text.strip("+−0.")
    return f"±{text[1:]}" if is_zero else text


def interval_note(interval: Interval | None) -> str:
    """Return a gap's interval as it follows the gap: `` (95 % interval −8.1 to +2.0)``.

    Its ends are in points. None is an interval of too few episodes.
    """
    if interval is None:
        return f" ({TOO_FEW})"
    low = points(interval.low, 1)
    high = points(interval.high, 1)
    return f" (95 % interval {low} to {high})"


def bounds_text(interval: Interval) -> str:
    """Return where a difference lies over a whole plan: ``between −8.1 and +2.0 points``."""
    return f"between {points(interval.low, 1)} and {points(interval.high, 1)} points"


def p_text(p_value: float) -> str:
    """Return a p-value with its sign, rounded half up: ``p = 0.012``, ``p < 0.001``."""
    return f"p < {_SMALLEST_P}" if p_value < _SMALLEST_P else f"p = {half_up(p_value, 3)}"


def anytime_text(p_value: float, pairs: PairedScenes, interval: Interval | None) -> str:
    """Return a p-value that holds at any time, and of an unfinished plan what was played.

    For example ``p = 0.21 after 84 of 550 scenes (over all of them between −2.0 and +30.1 points,
    95 %)``.

    Args:
        p_value: of the sum over scenes, which is said if the mean over tasks is another.
        pairs: the scenes that were looked at.
        interval: of the difference over all planned scenes; None if it is not known.
    """
    words = p_text(p_value)
    if not pairs.is_even:
        words += " (of the sum over scenes, as tasks differ in size)"
    if pairs.known == pairs.planned:
        return words
    words += f" after {pairs.known} of {counted(pairs.planned, 'scene')}"
    if interval is None:
        return words
    return f"{words} (over all of them {bounds_text(interval)}, 95 %)"


class GapWords(NamedTuple):
    """A gap in points, its interval, and its corrected p-value, as cells of a table."""

    gap: str
    interval: str
    p_value: str


def gap_words(gap: Gap | None, p_value: float | None) -> GapWords:
    """Return the cells of a table for a gap between two success rates; dashes without a gap.

    For example ``("−12.0", "−20.1 to −3.9", "0.004")``. The p-value is given apart because it was
    corrected for the number of tests; its cell is a dash if it is None.
    """
    if gap is None:
        return GapWords(NOT_APPLICABLE, NOT_APPLICABLE, NOT_APPLICABLE)
    interval = TOO_FEW
    if gap.interval is not None:
        interval = f"{points(gap.interval.low, 1)} to {points(gap.interval.high, 1)}"
    p_words = NOT_APPLICABLE
    if p_value is not None:
        p_words = p_text(p_value).removeprefix("p ").removeprefix("= ")
    return GapWords(points(gap.value, 1), interval, p_words)


def _rounded(value: Fraction) -> Decimal:
    """Round half up to two decimals: 1/8 becomes 0.13."""
    # In integers, floor(100 * value + 1/2): rounding a decimal quotient would round twice.
    hundredths = (200 * value.numerator + value.denominator) // (2 * value.denominator)
    return (Decimal(hundredths) * DIGITS).quantize(DIGITS, ROUND_HALF_UP)


def half_up(number: float, decimals: int) -> Decimal:
    """Round to some decimals, halves away from 0: with none, −12.5 becomes −13.

    A half may come as 12.499999999999998, so what is below nine decimals is dropped first.
    """
    exact = Decimal(str(round(number, 9)))
    return exact.quantize(Decimal(1).scaleb(-decimals), ROUND_HALF_UP)
