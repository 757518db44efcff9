"""The types of goal slots, and the words for their values.

The order is the order of speaking: colors come last, so that ``it`` in the command follows the
sentence about its cube.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence

from roboirg.core.goal_slots import SlotTypeName
from roboirg.language.phrases import Phrase
from roboirg.language.request import GoalValues, InstructionRequest
from roboirg.language.slot_types import amount, color, number, ordinal, relation
from roboirg.language.slot_types.slot_type import Fields, SlotType

__all__ = ["Fields", "described", "slot_types_in", "stated"]

SLOT_TYPES: Mapping[SlotTypeName, SlotType] = {
    slot_type.name: slot_type
    for slot_type in (
        number.NUMBER,
        ordinal.VISIT,
        ordinal.PLACEMENT,
        relation.RELATION,
        color.COLOR,
        amount.AMOUNT,
    )
}


def slot_types_in(request: InstructionRequest) -> Iterator[tuple[SlotType, GoalValues]]:
    """Yield the slot types in the goal with their values, in the order of speaking."""
    for name, slot_type in SLOT_TYPES.items():
        goal_values = request.values_of(name)
        if goal_values:
            yield slot_type, goal_values


def described(request: InstructionRequest, things: Sequence[Phrase]) -> Fields:
    """Return the fields of the command for the goal's colors, given a description of each."""
    fields: Fields = {}
    for slot_type, goal_values in slot_types_in(request):
        if slot_type.described is not None:
            fields |= slot_type.described(request, goal_values, things)
    return fields


def stated(request: InstructionRequest) -> Fields:
    """Return the fields of the command with every value named."""
    fields: Fields = {}
    for slot_type, goal_values in slot_types_in(request):
        fields |= slot_type.stated(request, goal_values)
    return fields
