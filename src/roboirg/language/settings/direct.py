"""The direct setting: an introduction names every value, and the command points back."""

from __future__ import annotations

from collections.abc import Iterator

from roboirg.core.instruction_options import InstructionOptions
from roboirg.language.phrases import sentences
from roboirg.language.request import InstructionRequest, InstructionSpec, UtteranceSpec
from roboirg.language.settings.setting import Instruct, Setting
from roboirg.language.slot_types import Fields, slot_types_in, stated


def introduction(request: InstructionRequest) -> UtteranceSpec:
    """Return the first utterance of direct and contextual instructions."""
    remarks = [
        slot_type.introduce(request, goal_values)
        for slot_type, goal_values in slot_types_in(request)
    ]
    return UtteranceSpec("introduction", sentences(remarks))


def command(request: InstructionRequest) -> UtteranceSpec:
    """Return the last utterance of direct and contextual instructions."""
    if request.resolved:
        return UtteranceSpec("command", request.command(stated(request)))
    fields: Fields = {}
    for slot_type, goal_values in slot_types_in(request):
        fields |= slot_type.reduced(request, goal_values)
    return UtteranceSpec("command", request.command(fields))


def say(request: InstructionRequest) -> InstructionSpec:
    """Return introduction and command."""
    return InstructionSpec((introduction(request), command(request)))


def _pairing_rules(instruct: Instruct) -> Iterator[str]:
    introduction = instruct(InstructionOptions("direct")).turns[0]
    explicit = instruct(InstructionOptions("explicit")).command
    resolved = instruct(InstructionOptions("direct", "resolved"))
    if resolved.turns != (introduction, explicit):
        yield "resolved, its command is not the explicit one"


SETTING = Setting(
    name="direct",
    order=1,
    summary="an introduction names every value; the command points back at it",
    color="#0072B2",
    say=say,
    reads=frozenset({"delivery", "language"}),
    pairing_rules=_pairing_rules,
    example=2,
    offers="direct",
)
