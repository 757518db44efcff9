"""Printed rates and gaps, and averages of printed rates.

In tables of the paper a cell is rounded half up to two decimals, and an average is the mean of the
rounded cells, again rounded half up. This rule gives every published average to the last digit;
means of the unrounded rates differ in the last digit in six of them.
"""

from __future__ import annotations

from collections.abc import Sequence
from decimal import ROUND_HALF_UP, Decimal
from fractions import Fraction

from roboirg.evaluation.analysis.stats.intervals import TOO_FEW, Interval
from roboirg.evaluation.analysis.stats.paired_tests import Gap

NOT_APPLICABLE = "–"
DIGITS = Decimal("0.01")

_SMALLEST_P = 0.001


def percent(rate: Fraction) -> Decimal:
    """Return a rate from 0 to 1 in percent with two decimals, rounded half up."""
    return _rounded(100 * rate)


def mean_percent(cells: Sequence[Decimal]) -> Decimal:
    """Return the unweighted mean of printed rates, rounded by the same rule."""
    return _rounded(sum(map(Fraction, cells), Fraction(0)) / len(cells))


def change_text(change: Decimal) -> str:
    """Return the difference of two printed rates with an arrow: ``↑1.33``, ``→0.00``."""
    arrow = "→" if not change else "↑" if change > 0 else "↓"
    return f"{arrow}{abs(change)}"


def whole_percent(rate: float | Fraction) -> str:
    """Return a rate from 0 to 1 as a whole percentage."""
    return f"{100 * float(rate):.0f}"


def percent_range(low: Fraction, high: Fraction) -> str:
    """Return two rates as whole percentages, one if they are equal then: ``3–7``."""
    return "–".join(dict.fromkeys((whole_percent(low), whole_percent(high))))


def points(gap: float, decimals: int = 0) -> str:
    """Return a gap in signed percentage points, with a proper minus: ``−12``, ``+3``, ``±0``."""
    text = f"{100 * gap:+.{decimals}f}".replace("-", "−")
    return f"±{text[1:]}" if not text.strip("+−0.") else text


def interval_note(interval: Interval | None) -> str:
    """Return the ends of a gap's interval in brackets, after a blank, or why it has none."""
    if interval is None:
        return f" ({TOO_FEW})"
    low, high = (points(end, 1) for end in interval)
    return f" (95 % interval {low} to {high})"


def p_text(p_value: float) -> str:
    """Return a p-value with its sign: ``p = 0.012``, ``p < 0.001``."""
    return f"p < {_SMALLEST_P}" if p_value < _SMALLEST_P else f"p = {p_value:.3f}"


def gap_words(gap: Gap | None, p_value: float | None) -> tuple[str, str, str]:
    """Return a gap in points, its interval, and its corrected p-value; dashes without one."""
    if gap is None:
        return NOT_APPLICABLE, NOT_APPLICABLE, NOT_APPLICABLE
    ends = TOO_FEW
    p_words = NOT_APPLICABLE
    if gap.interval is not None:
        ends = " to ".join(points(end, 1) for end in gap.interval)
    if p_value is not None:
        p_words = p_text(p_value).removeprefix("p ").removeprefix("= ")
    return points(gap.value, 1), ends, p_words


def _rounded(value: Fraction) -> Decimal:
    # In integers: rounding a decimal quotient would round twice.
    hundredths = (200 * value.numerator + value.denominator) // (2 * value.denominator)
    return (Decimal(hundredths) * DIGITS).quantize(DIGITS, ROUND_HALF_UP)
