"""The meaning that a scenario declares, built from the words as they are said.

No term looks at the goal: what has not been said has no operands, and then no goal fits.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

from roboirg.language.instruction import Described, Term
from roboirg.language.scenarios.introduced import IntroducedValue
from roboirg.language.scenarios.markup import Pointer
from roboirg.language.scenarios.scenario import Operation

Operand = str | int | Described

_RANKS: Mapping[str, int] = {"former": 1, "latter": 2, "first": 1, "second": 2, "third": 3}
"""Positions that classes of expressions name."""
_DIRECTIONS: Mapping[Operation, int] = {"minus": -1, "earlier": -1, "plus": 1, "later": 1}
"""Of a step that is said."""
_STEPS: Mapping[Operation, int] = {"before": -1, "after": 1, "two before": -2, "two after": 2}
"""Steps that the operation itself names."""


@dataclass(slots=True)
class SaidValues:
    """The values that the words have named so far.

    Attributes:
        frame: whose left and right places mean.
        by_slot: the values of each slot that was said, in the order of speaking.
    """

    frame: str
    by_slot: dict[str, tuple[IntroducedValue, ...]] = field(default_factory=dict)

    def add(self, slot: str, values: tuple[IntroducedValue, ...]) -> None:
        """Remember the values that a slot names."""
        self.by_slot[slot] = values

    def operands(self, slot: str) -> tuple[Operand, ...]:
        """Return what a slot named; ``colors.1`` is the second of ``colors``. Empty if nothing."""
        base, _, number = slot.partition(".")
        values = self.by_slot.get(slot, ())
        if not values and number:
            values = self.by_slot.get(base, ())[int(number) : int(number) + 1]
        return tuple(self._operand(value) for value in values)

    def listed(self, base: str) -> tuple[Operand, ...]:
        """Return the members of a list, named together or one by one, as they were said."""
        if base in self.by_slot:
            return self.operands(base)
        members: list[Operand] = []
        for slot in self.by_slot:
            if slot.startswith(f"{base}."):
                members += self.operands(slot)
        return tuple(members)

    def _operand(self, value: IntroducedValue) -> Operand:
        if value.kind == "place":
            return Described(value.words, "place", self.frame)
        if value.kind == "clue":
            return Described(value.words, "clue", self.frame)
        return value.value


def pointed_term(pointer: Pointer, said: SaidValues) -> Term:
    """Return the term of words that point back at what was said."""
    operation, slot = pointer.operation, pointer.of
    if operation == "rank":
        base = slot.partition(".")[0]
        members = said.listed("list") or said.listed(base)
        return Term("rank", members, rank=_rank_of(pointer, said))
    if operation == "other":
        members = said.listed("list")
        taken = said.operands("taken")
        rank = members.index(taken[0]) + 1 if taken and taken[0] in members else 0
        return Term("other", members, rank)
    if operation == "without":
        return Term("without", said.listed("excluded"))
    if slot == "rest":
        return Term("without", said.listed("aside"))
    if operation in ("double", "half"):
        return Term("double" if operation == "double" else "half", said.operands(slot))
    if operation in _STEPS:
        return Term("step", said.operands(slot), step=_STEPS[operation])
    if operation in _DIRECTIONS:
        return Term("step", said.operands(slot), step=_DIRECTIONS[operation] * _step_of(said))
    operands = said.operands(slot)
    if not operands and "rank" in said.by_slot:
        # "It's the second one's turn, so pick it up": a list was named, then a position in it.
        return Term("rank", said.listed("list"), rank=_rank_said(said))
    return Term("same", operands)


def _rank_of(pointer: Pointer, said: SaidValues) -> int:
    """Return the position that words name, by their class or as the number in them."""
    if pointer.expression in _RANKS:
        return _RANKS[pointer.expression]
    return _rank_said(said)


def _rank_said(said: SaidValues) -> int:
    (rank,) = said.by_slot["rank"]
    return int(rank.value)


def _step_of(said: SaidValues) -> int:
    (step,) = said.by_slot["step"]
    return int(step.value)


def chosen_term(remark: str, pointer: Pointer | None, said: SaidValues) -> Term:
    """Return the term of a value that a remark has chosen from a list of two.

    Args:
        remark: ``former`` or ``latter``, or what it sets aside: ``not_former``, ``not_latter``.
        pointer: the words for the field; *the other one* is the one that was not chosen.
        said: what was said before.
    """
    rank = 1 if remark in ("former", "not_latter") else 2
    if pointer is not None and pointer.operation == "other":
        return Term("other", said.listed("list"), rank)
    return Term("rank", said.listed("list"), rank)
