"""The meaning that a scenario declares, built from the words as they are said.

No term looks at the goal: what has not been said has no operands, and then no goal fits.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import NamedTuple

from roboirg.language.instruction import Described, Term
from roboirg.language.landmarks import Frame
from roboirg.language.scenarios.introduced import IntroducedValue
from roboirg.language.scenarios.markup import Operation, Pointer

Operand = str | int | Described

_RANKS: Mapping[str, int] = {"former": 1, "latter": 2, "first": 1, "second": 2, "third": 3}
"""Positions that classes of expressions name."""
_DIRECTIONS: Mapping[Operation, int] = {"minus": -1, "earlier": -1, "plus": 1, "later": 1}
"""Of a step that is said."""
_DESCRIBED = ("place", "clue")
"""Slots of a thing that is not named by its value."""
_STEPS: Mapping[Operation, int] = {"before": -1, "after": 1}
"""Steps that the operation itself names."""


class ChoosingRemark(NamedTuple):
    """Words before the command that choose from a list of two, such as *Let's skip the former*.

    Attributes:
        pointer: the words that point at one of the two.
        sets_aside: whether it is the other one that is chosen.
    """

    pointer: Pointer
    sets_aside: bool


@dataclass(slots=True)
class SaidValues:
    """The values that the words have named so far.

    Attributes:
        frame: whose left and right places mean.
        by_slot: the values of each slot that was said, in the order of speaking.
    """

    frame: Frame
    by_slot: dict[str, tuple[IntroducedValue, ...]] = field(default_factory=dict)

    def add(self, slot: str, values: tuple[IntroducedValue, ...]) -> None:
        """Remember the values that a slot names."""
        self.by_slot[slot] = values

    def operands(self, slot: str) -> tuple[Operand, ...]:
        """Return what a slot named; empty if it was not said.

        ``colors.1`` may have been named alone, or as the second of ``colors``.
        """
        values = self.by_slot.get(slot, ())
        base, _, number = slot.partition(".")
        if not values and number:
            together = self.by_slot.get(base, ())
            at = int(number)
            values = together[at : at + 1]
        return tuple(self._operand(value) for value in values)

    def listed(self, *bases: str) -> tuple[Operand, ...]:
        """Return the members of a list, named together or one by one, as they were said.

        Of several bases, the members are those of any: a cube by its color, another by its place.
        """
        members: list[Operand] = []
        for slot in self.by_slot:
            base, _, number = slot.partition(".")
            # Members of a list that was also named together would count twice.
            is_new = not number or base not in self.by_slot
            if base in bases and is_new:
                members += self.operands(slot)
        return tuple(members)

    def _operand(self, value: IntroducedValue) -> Operand:
        """Return a value, or the description in its place."""
        if value.kind == "place":
            return Described(value.words, "place", self.frame)
        if value.kind == "clue":
            return Described(value.words, "clue", self.frame)
        return value.value


def pointed_term(pointer: Pointer, said: SaidValues) -> Term:
    """Return the term of words that point back: how their value follows from what was said.

    *it* has the same value as was said, *the former* the first of those listed, *one more than
    that* a number and a step.
    """
    slot = pointer.of
    operation = pointer.operation
    if operation == "rank":
        base = slot.partition(".")[0]
        members = said.listed("list") or said.listed(base, *_DESCRIBED)
        return Term("rank", members, _rank_of(pointer, said))
    if operation == "other":
        return _other_term(said)
    if operation in ("without", "neighbor") or slot == "rest":  # what is left of all
        return Term("without", _set_aside(said))
    operands = said.operands(slot)
    if not operands and "rank" in said.by_slot and operation not in ("double", "half"):
        # "It's the second one's turn, so pick it up": a list was named, then a position in it.
        return Term("rank", said.listed("list"), _rank_of(pointer, said))
    return _reckoned_term(operation, operands, said)


def _reckoned_term(operation: Operation, operands: tuple[Operand, ...], said: SaidValues) -> Term:
    """Return the term of what was said itself, or of a number that follows from it."""
    if operation == "double":
        return Term("double", operands)
    if operation == "half":
        return Term("half", operands)
    step = _step_of(operation, said)
    if step:
        return Term("step", operands, step=step)
    return Term("same", operands)


def _set_aside(said: SaidValues) -> tuple[Operand, ...]:
    """Return what was named so that something else is left; empty if nothing was."""
    for slot in ("excluded", "aside", "kept", "reference"):
        members = said.listed(slot)
        if members:
            return members
    return ()


def _other_term(said: SaidValues) -> Term:
    """Return the term of *the other one*: of a list without what is taken, or of all without it."""
    members = said.listed("list")
    taken = said.operands("taken")
    if taken and not members:
        return Term("without", taken)
    return Term("other", members, _taken_rank(members, said))


def _taken_rank(members: tuple[Operand, ...], said: SaidValues) -> int:
    """Return the position in a list of what is said to be taken; 0 if it is not in it."""
    taken = said.operands("taken")
    if not taken or taken[0] not in members:
        return 0
    return members.index(taken[0]) + 1


def _rank_of(pointer: Pointer, said: SaidValues) -> int:
    """Return the position that words name, by their class or as the number in them."""
    if pointer.expression in _RANKS:
        return _RANKS[pointer.expression]
    (rank,) = said.by_slot["rank"]
    return int(rank.value)


def _step_of(operation: Operation, said: SaidValues) -> int:
    """Return by how much an operation differs from the number that was said; 0 for most."""
    if operation in _DIRECTIONS:
        (step,) = said.by_slot["step"]
        return _DIRECTIONS[operation] * int(step.value)
    return _STEPS.get(operation, 0)


def chosen_term(pointer: Pointer, remark: ChoosingRemark, said: SaidValues) -> Term:
    """Return the term of words for a value that a remark has chosen from a list of two.

    *The other one* is the one that was not chosen.
    """
    members = said.listed("list")
    rank = _RANKS[remark.pointer.expression]
    if remark.sets_aside:
        rank = 3 - rank  # the other one of two
    if pointer.operation == "other":
        return Term("other", members, rank)
    return Term("rank", members, rank)
