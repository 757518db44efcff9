"""How far people agree who were asked the same."""

from __future__ import annotations

from collections import Counter
from collections.abc import Hashable, Iterable, Sequence

Unit = Sequence[Hashable]
"""The answers of different people to one question."""


def pairwise_agreement(units: Iterable[Unit]) -> float | None:
    """Return the share of pairs of answers to the same question that are equal; None without one.

    Every question with two answers or more counts the same.
    """
    shares = []
    for unit in units:
        pairs = len(unit) * (len(unit) - 1)
        if pairs:
            shares.append(sum(count * (count - 1) for count in Counter(unit).values()) / pairs)
    return sum(shares) / len(shares) if shares else None


def krippendorff_alpha(units: Iterable[Unit]) -> float | None:
    """Return Krippendorff's alpha of nominal answers.

    1 is perfect agreement, 0 what answers by chance would have that are as frequent as these.
    Questions with one answer do not count (Krippendorff, Content Analysis, 2004, chapter 11).

    Returns:
        None if no question has two answers, or all answers are equal: chance agrees then as well.
    """
    several = [Counter(unit) for unit in units if len(unit) > 1]
    totals: Counter[Hashable] = Counter()
    for unit in several:
        totals.update(unit)
    count = totals.total()
    expected = count * (count - 1) - sum(one * (one - 1) for one in totals.values())
    if not expected:
        return None
    observed = sum(
        (unit.total() ** 2 - sum(one**2 for one in unit.values())) / (unit.total() - 1)
        for unit in several
    )
    return 1 - (count - 1) * observed / expected
