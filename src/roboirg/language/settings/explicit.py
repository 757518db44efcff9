"""The explicit setting: one command states every slot."""

from __future__ import annotations

from roboirg.language.request import InstructionRequest, InstructionSpec, UtteranceSpec
from roboirg.language.setting import Setting
from roboirg.language.slot_types import Fields, slot_types_in
from roboirg.language.wordings.worded_command import goal_fields


def stated(request: InstructionRequest) -> Fields:
    """Return the fields of the command with every value named."""
    if request.wordings is not None:
        return {name: request.outside_stated(name) for name in goal_fields(request.episode.goal)}
    fields: Fields = {}
    for slot_type, goal_values in slot_types_in(request):
        fields |= slot_type.stated(request, goal_values)
    return fields


def say(request: InstructionRequest) -> InstructionSpec:
    """Return the command alone."""
    return InstructionSpec((UtteranceSpec("command", request.command(stated(request))),))


SETTING = Setting(
    name="explicit",
    order=0,
    summary="one command states every value",
    color="#000000",
    say=say,
    hidden_slots=lambda _instruction, _goal: frozenset(),
    implicit=False,
)
