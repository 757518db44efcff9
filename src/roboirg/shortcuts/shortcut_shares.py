"""How often shortcuts are right: a row of a table, scored anew or read from a file of floors."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import NamedTuple

from roboirg.stats.intervals import ALPHA, critical_value

MARGIN = 0.05
"""By how much a floor may exceed chance before its setting counts as solved by it."""
FEWEST_TEXTS = 50
"""With fewer, the interval of an excess holds the true one in less than 93 of 100 simulations."""
Group = tuple[str, ...]
"""A setting, and within it a reasoning pattern, task or slot if the table has a row for each."""


class ShortcutShares(NamedTuple):
    """How often a shortcut is right, as means over instructions, 0 to 1.

    Attributes:
        slots: the share of scored slots that it guesses right; None if none is scored.
        goals: the share of instructions whose whole goal it guesses right.
    """

    slots: float | None
    goals: float


class Excess(NamedTuple):
    """By how much the floor ``text-only`` exceeds the larger of chance and ``majority``.

    Attributes:
        value: difference of the shares of slots, -1 to 1.
        error: its standard error, over instructions.
    """

    value: float
    error: float

    def interval(self, count: int) -> tuple[float, float]:
        """Return its interval, Bonferroni-adjusted for `count` of them.

        95 % of the time all of these are right.
        """
        reach = critical_value(ALPHA / count) * self.error
        return self.value - reach, self.value + reach


@dataclass(frozen=True, slots=True)
class ShortcutRow:
    """One row of the table.

    Attributes:
        group: what the row is about, ``("direct", "PickXtimes")``.
        count: number of instructions.
        shares: by shortcut, in the order of the columns.
        excess: of the learner of the words; None without learned floors, or scored slots.
    """

    group: Group
    count: int
    shares: Mapping[str, ShortcutShares]
    excess: Excess | None = None
