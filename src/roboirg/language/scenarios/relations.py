"""The relations from which a number, or a position in a series, follows in reasoning."""

from __future__ import annotations

from typing import NamedTuple

from roboirg.language.scenarios.markup import Operation


class Relation(NamedTuple):
    """How a number follows from another one, or a position in a series from another position.

    *One fewer* gives 2 from 3: ``result = factor * reference + offset`` with the offset -1.

    Attributes:
        name: for scenarios and records.
        operation: of the words that say it, ``minus`` for *one fewer than that*.
        offset: see above.
        factor: see above.
        spells: the number that the words contain, 1 for *one fewer*; they would give away a result
            of this value. None if they contain none.
    """

    name: str
    operation: Operation
    offset: int = 0
    factor: float = 1.0
    spells: int | None = None

    def reference(self, result: int) -> int | None:
        """Return the number from which a result follows: 3 for the result 2 and *one fewer*.

        None if that is no whole number: nothing doubled is 3.
        """
        reference = (result - self.offset) / self.factor
        return int(reference) if reference.is_integer() else None


RELATIONS = (
    Relation("one fewer", "minus", offset=-1, spells=1),
    Relation("one more", "plus", offset=1, spells=1),
    Relation("two fewer", "minus", offset=-2, spells=2),
    Relation("two more", "plus", offset=2, spells=2),
    Relation("twice", "double", factor=2.0, spells=2),
    Relation("half", "half", factor=0.5),
)
STEPS = (
    Relation("right after", "after", offset=1),
    Relation("right before", "before", offset=-1),
    Relation("two after", "after", offset=2, spells=2),
    Relation("two before", "before", offset=-2, spells=2),
)
"""Positions in time."""
COUNTED_STEPS = (
    Relation("one earlier", "earlier", offset=-1, spells=1),
    Relation("one later", "later", offset=1, spells=1),
    Relation("two earlier", "earlier", offset=-2, spells=2),
    Relation("two later", "later", offset=2, spells=2),
)
"""The same as numbers: *one visit earlier than that*."""
NEIGHBOR = Relation("neighbor", "neighbor")
"""Of two moments, each is next to the other one."""
EVERY_RELATION = {
    relation.name: relation for relation in (*RELATIONS, *COUNTED_STEPS, *STEPS, NEIGHBOR)
}
"""By name."""
