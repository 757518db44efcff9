"""How the value of a pointer follows from the words, as data: the terms of a meaning.

A pointer is words that point back (an anaphor): *it*, *the latter*, *one fewer than that*. Its
operation says how its value follows from what was named before. No term looks at the goal: if that
was not named, the term has no operands, and then no goal fits.

- *slot*: a name for what a sentence says or points back at: ``color``, ``list``, ``taken``.
- *operand*: a value that was named in a slot, or the description of a thing.
- *term*: an operation with its operands, for `roboirg.language.meaning` to compute.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Literal, NamedTuple

from roboirg.language.instruction import Described, Term
from roboirg.language.landmarks import Frame
from roboirg.language.scenarios.fillers import Filler
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
"""Of a step whose size is said: *two more than that*."""
_STEPS: Mapping[Operation, int] = {"before": -1, "after": 1}
"""Steps that the operation itself names: *right before that*."""
_SLOTS_SET_ASIDE = ("excluded", "aside", "kept", "reference")
"""Slots of what is named so that something else is left; the first one that was said counts."""


class ChoosingRemark(NamedTuple):
    """Words before the command that choose from a list of two, such as *Let's skip the former*.

    Attributes:
        pointer: the words that point at one of the two: *the former*.
        sets_aside: whether it is the other one that is chosen, as by *skip*.
    """

    pointer: Pointer
    sets_aside: bool


@dataclass(slots=True)
class DiscourseHistory:
    """What the sentences of a text have named so far; pointers can only mean this.

    After *Red and blue are left.*: ``{"list": (<red>, <blue>)}``.

    Attributes:
        frame: whose left and right places mean.
        by_slot: the values of each slot that was said, in the order of speaking.
    """

    frame: Frame
    by_slot: dict[str, tuple[Filler, ...]] = field(default_factory=dict)

    def add(self, slot: str, values: tuple[Filler, ...]) -> None:
        """Remember the values that a slot names."""
        self.by_slot[slot] = values

    def operands(self, slot: str) -> tuple[Operand, ...]:
        """Return what a slot named: values, or descriptions of things; empty if it was not said.

        ``colors.1``, the second color, may have been named alone, or as the second of ``colors``.
        """
        values = self.by_slot.get(slot, ())
        base, _, number = slot.partition(".")
        if not values and number:
            at = int(number)
            values = self.by_slot.get(base, ())[at : at + 1]
        return tuple(self._operand(value) for value in values)

    def number(self, slot: str) -> int:
        """Return the number that a slot named; the slot must have been said, with one value."""
        (number,) = self.by_slot[slot]
        return int(number.value)

    def listed(self, *bases: str) -> tuple[Operand, ...]:
        """Return the members of lists, named together or one by one, in the order of speaking.

        ``listed("list")`` after *red or blue* gives ``("red", "blue")``. Of several lists,
        ``place`` and ``clue``, the members are those of any: a cube by its place, another by what
        is seen.
        """
        members: list[Operand] = []
        for slot in self.by_slot:
            base, _, number = slot.partition(".")
            # Members of a list that was also named together would count twice.
            is_new = not number or base not in self.by_slot
            if base in bases and is_new:
                members += self.operands(slot)
        return tuple(members)

    def _operand(self, value: Filler) -> Operand:
        """Return a value as an operand: itself, *red*, or a description, *on the left*."""
        if value.kind == "place":
            return Described(value.words, "place", self.frame)
        if value.kind == "clue":
            return Described(value.words, "clue", self.frame)
        return value.value


def pointed_term(pointer: Pointer, history: DiscourseHistory) -> Term:
    """Return the term of a pointer: how its value follows from what was named before.

    *it* has the same value as was named, *the former* the first of those listed, *one more than
    that* a number and a step: ``Term("step", (2,), step=1)`` after *two*.
    """
    if pointer.of == "rest":  # the thing that is left when two are set aside
        return _without_set_aside(pointer, history)
    return _TERM_OF[pointer.operation](pointer, history)


def _same(pointer: Pointer, history: DiscourseHistory) -> Term:
    """Return the term of *it*, which is what was named: ``Term("same", ("red",))``.

    If its slot was not named but a position in a list, it is the value at this position.
    """
    operands = history.operands(pointer.of)
    if not operands and "rank" in history.by_slot:
        # "It's the second one's turn, so pick it up": a list was named, then a position in it.
        return Term("rank", history.listed("list"), _rank_of(pointer, history))
    return Term("same", operands)


def _ranked(pointer: Pointer, history: DiscourseHistory) -> Term:
    """Return the term of *the latter*, a position in what was listed.

    After *red or blue*: ``Term("rank", ("red", "blue"), rank=2)``. Without a list, the members are
    what was named one by one, by value or by description.
    """
    base = pointer.of.partition(".")[0]
    members = history.listed("list") or history.listed(base, "place", "clue")
    return Term("rank", members, _rank_of(pointer, history))


def _other(_pointer: Pointer, history: DiscourseHistory) -> Term:
    """Return the term of *the other one*.

    After *red or blue; blue is taken* it is the other one than the second of the two,
    ``Term("other", ("red", "blue"), rank=2)``. Without a list it is what the taken one leaves of
    all that the scene has.
    """
    members = history.listed("list")
    taken = history.operands("taken")
    if taken and not members:
        return Term("without", taken)
    return Term("other", members, _taken_rank(members, history))


def _without_set_aside(_pointer: Pointer, history: DiscourseHistory) -> Term:
    """Return the term of *the one that's left*, of all that the scene has.

    After *not red and not blue*: ``Term("without", ("red", "blue"))``.
    """
    for slot in _SLOTS_SET_ASIDE:
        members = history.listed(slot)
        if members:
            return Term("without", members)
    return Term("without", ())


def _multiplied(pointer: Pointer, history: DiscourseHistory) -> Term:
    """Return the term of *twice as often as that*, or of *half as often*.

    ``Term("double", (2,))`` after *two times*.
    """
    operation: Literal["double", "half"] = "double" if pointer.operation == "double" else "half"
    return Term(operation, history.operands(pointer.of))


def _stepped(pointer: Pointer, history: DiscourseHistory) -> Term:
    """Return the term of *two fewer than that*, or of *right before that*.

    After *four*, *two fewer than that* is ``Term("step", (4,), step=-2)``. Its operation gives the
    sign, and the words, or else the operation, the size.
    """
    step = _STEPS.get(pointer.operation)
    if step is None:
        step = _STEP_SIGNS[pointer.operation] * history.number("step")
    return Term("step", history.operands(pointer.of), step=step)


_TERM_OF: Mapping[Operation, Callable[[Pointer, DiscourseHistory], Term]] = {
    "same": _same,
    "place": _same,
    "seen": _same,
    "rank": _ranked,
    "other": _other,
    "without": _without_set_aside,
    "neighbor": _without_set_aside,
    "double": _multiplied,
    "half": _multiplied,
    "minus": _stepped,
    "plus": _stepped,
    "earlier": _stepped,
    "later": _stepped,
    "before": _stepped,
    "after": _stepped,
}
"""What makes the term of a pointer, by its operation."""


def _taken_rank(members: tuple[Operand, ...], history: DiscourseHistory) -> int:
    """Return the position, from 1, of what is said to be taken in a list; 0 if it is not in it."""
    taken = history.operands("taken")
    if not taken or taken[0] not in members:
        return 0
    return members.index(taken[0]) + 1


def _rank_of(pointer: Pointer, history: DiscourseHistory) -> int:
    """Return the position, from 1, that a pointer names: 2 for *the latter*.

    A pointer without a class of its own, *the third one*, has it as the slot ``rank``.
    """
    if pointer.expression in _RANK_BY_EXPRESSION:
        return _RANK_BY_EXPRESSION[pointer.expression]
    return history.number("rank")


def chosen_term(pointer: Pointer, remark: ChoosingRemark, history: DiscourseHistory) -> Term:
    """Return the term of a pointer after a remark that has chosen one of a list of two.

    *Red or blue? Let's skip the former. Take that one.*: *that one* is the second,
    ``Term("rank", ("red", "blue"), rank=2)``. A pointer such as *the other one* means the one that
    the remark has not chosen.
    """
    members = history.listed("list")
    rank = _RANK_BY_EXPRESSION[remark.pointer.expression]
    if remark.sets_aside:
        rank = 3 - rank  # the other one of two
    if pointer.operation == "other":
        return Term("other", members, rank)
    return Term("rank", members, rank)
