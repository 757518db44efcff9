"""The meaning that a scenario declares, built from the words as they are said.

No term looks at the goal: what has not been said has no operands, and then no goal fits.

- *slot*: a name for what a sentence says or points back at: ``color``, ``list``, ``taken``.
- *operand*: a value that was said in a slot, or the description of a thing.
- *pointer*: words that point back at a slot, *the latter*. Its operation leads to the value.
- *term*: an operation with its operands, for `roboirg.language.meaning` to work out.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import NamedTuple

from roboirg.language.instruction import Described, Term
from roboirg.language.landmarks import Frame
from roboirg.language.scenarios.introduced import IntroducedValue
from roboirg.language.scenarios.markup import Operation, Pointer

Operand = str | int | Described

_RANK_BY_EXPRESSION: Mapping[str, int] = {
    "former": 1,
    "latter": 2,
    "first": 1,
    "second": 2,
    "third": 3,
}
"""Positions that classes of expressions name."""
_STEP_SIGNS: Mapping[Operation, int] = {"minus": -1, "earlier": -1, "plus": 1, "later": 1}
"""Of a step that is said."""
_STEPS: Mapping[Operation, int] = {"before": -1, "after": 1}
"""Steps that the operation itself names."""
_SLOTS_SET_ASIDE = ("excluded", "aside", "kept", "reference")
"""Slots of what is named so that something else is left."""


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
        """Return what a slot named: values, or descriptions of things; empty if it was not said.

        ``colors.1`` may have been named alone, or as the second of ``colors``.
        """
        values = self.by_slot.get(slot, ())
        base, _, number = slot.partition(".")
        if not values and number:
            at = int(number)
            values = self.by_slot.get(base, ())[at : at + 1]
        return tuple(self._operand(value) for value in values)

    def number(self, slot: str) -> int:
        """Return the number that a slot named."""
        (number,) = self.by_slot[slot]
        return int(number.value)

    def listed(self, *bases: str) -> tuple[Operand, ...]:
        """Return the members of lists, named together or one by one, in the order of speaking.

        Of several bases, ``place`` and ``clue``, the members are those of any: a cube by its color,
        another by its place.
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
    if pointer.of == "rest":  # the thing that is left when two are set aside
        return _without_set_aside(pointer, said)
    return _TERM_OF[pointer.operation](pointer, said)


def _same(pointer: Pointer, said: SaidValues) -> Term:
    """Return the term of *it*, which is what was said."""
    operands = said.operands(pointer.of)
    if not operands and "rank" in said.by_slot:
        # "It's the second one's turn, so pick it up": a list was named, then a position in it.
        return Term("rank", said.listed("list"), _rank_of(pointer, said))
    return Term("same", operands)


def _ranked(pointer: Pointer, said: SaidValues) -> Term:
    """Return the term of *the latter*, which has a position in a list.

    Without a list, in what was named one by one, by value or by description.
    """
    base = pointer.of.partition(".")[0]
    members = said.listed("list") or said.listed(base, "place", "clue")
    return Term("rank", members, _rank_of(pointer, said))


def _other(_pointer: Pointer, said: SaidValues) -> Term:
    """Return the term of *the other one*: of a list without what is taken, or of all without it."""
    members = said.listed("list")
    taken = said.operands("taken")
    if taken and not members:
        return Term("without", taken)
    return Term("other", members, _taken_rank(members, said))


def _without_set_aside(_pointer: Pointer, said: SaidValues) -> Term:
    """Return the term of *the one that is left* of all, without what was set aside."""
    for slot in _SLOTS_SET_ASIDE:
        members = said.listed(slot)
        if members:
            return Term("without", members)
    return Term("without", ())


def _doubled(pointer: Pointer, said: SaidValues) -> Term:
    """Return the term of *twice as often as that*."""
    return Term("double", said.operands(pointer.of))


def _halved(pointer: Pointer, said: SaidValues) -> Term:
    """Return the term of *half as often as that*."""
    return Term("half", said.operands(pointer.of))


def _stepped(pointer: Pointer, said: SaidValues) -> Term:
    """Return the term of *one more than that*, or of *right before that*."""
    step = _STEPS.get(pointer.operation)
    if step is None:
        step = _STEP_SIGNS[pointer.operation] * said.number("step")
    return Term("step", said.operands(pointer.of), step=step)


_TERM_OF: Mapping[Operation, Callable[[Pointer, SaidValues], Term]] = {
    "same": _same,
    "place": _same,
    "seen": _same,
    "rank": _ranked,
    "other": _other,
    "without": _without_set_aside,
    "neighbor": _without_set_aside,
    "double": _doubled,
    "half": _halved,
    "minus": _stepped,
    "plus": _stepped,
    "earlier": _stepped,
    "later": _stepped,
    "before": _stepped,
    "after": _stepped,
}
"""What makes the term of a pointer, by its operation."""


def _taken_rank(members: tuple[Operand, ...], said: SaidValues) -> int:
    """Return the position in a list of what is said to be taken; 0 if it is not in it."""
    taken = said.operands("taken")
    if not taken or taken[0] not in members:
        return 0
    return members.index(taken[0]) + 1


def _rank_of(pointer: Pointer, said: SaidValues) -> int:
    """Return the position that words name, by their class or as the number in them."""
    if pointer.expression in _RANK_BY_EXPRESSION:
        return _RANK_BY_EXPRESSION[pointer.expression]
    return said.number("rank")


def chosen_term(pointer: Pointer, remark: ChoosingRemark, said: SaidValues) -> Term:
    """Return how a value follows from a list of two of which a remark has chosen one.

    *Let's skip the former* chooses the second. Words for *the other one* then mean the one that was
    not chosen.
    """
    members = said.listed("list")
    rank = _RANK_BY_EXPRESSION[remark.pointer.expression]
    if remark.sets_aside:
        rank = 3 - rank  # the other one of two
    if pointer.operation == "other":
        return Term("other", members, rank)
    return Term("rank", members, rank)
