"""The kinds of values that a goal can hold, and how each is spoken of.

The order is the order of speaking: colors come last, so that ``it`` in the command follows the
sentence about its cube.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence

from roboirg.language.phrases import Phrase
from roboirg.language.request import GoalValue, InstructionRequest, SlotTypeName
from roboirg.language.slot_types import amount, color, number, ordinal, relation
from roboirg.language.slot_types.slot_type import Fields, SlotType

__all__ = ["SLOT_TYPES", "Fields", "SlotType", "described", "slot_types_in"]

SLOT_TYPES: Mapping[SlotTypeName, SlotType] = {
    kind.name: kind
    for kind in (
        number.NUMBER,
        ordinal.VISIT,
        ordinal.PLACEMENT,
        relation.RELATION,
        color.COLOR,
        amount.AMOUNT,
    )
}


def slot_types_in(request: InstructionRequest) -> Iterator[tuple[SlotType, tuple[GoalValue, ...]]]:
    """The kinds that the goal has values of, in the order of speaking, with these values."""
    for name, kind in SLOT_TYPES.items():
        parts = request.parts_of(name)
        if parts:
            yield kind, parts


def described(request: InstructionRequest, things: Sequence[Phrase]) -> Fields:
    """The fields of the command for the goal's colors, given a description for each of them."""
    fields: Fields = {}
    for kind, parts in slot_types_in(request):
        if kind.described is not None:
            fields |= kind.described(parts, things)
    return fields
