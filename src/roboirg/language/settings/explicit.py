"""Explicit: one command that states every slot."""

from __future__ import annotations

from roboirg.language.request import InstructionRequest, InstructionSpec, UtteranceSpec
from roboirg.language.setting import Setting
from roboirg.language.slot_types import Fields, slot_types_in


def stated(request: InstructionRequest) -> Fields:
    """The fields of the command, every value named outright."""
    fields: Fields = {}
    for kind, parts in slot_types_in(request):
        fields |= kind.stated(request, parts)
    return fields


def say(request: InstructionRequest) -> InstructionSpec:
    """The command alone."""
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
