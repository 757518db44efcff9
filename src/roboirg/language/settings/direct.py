"""Direct: an introduction names every slot value, the command only points back."""

from __future__ import annotations

from roboirg.language.phrases import sentences
from roboirg.language.request import InstructionRequest, InstructionSpec, UtteranceSpec
from roboirg.language.setting import Setting
from roboirg.language.settings.explicit import stated
from roboirg.language.slot_types import Fields, slot_types_in


def introduction(request: InstructionRequest) -> UtteranceSpec:
    """What direct and contextual instructions begin with."""
    said = [kind.introduce(request, parts) for kind, parts in slot_types_in(request)]
    return UtteranceSpec("introduction", sentences(said))


def command(request: InstructionRequest) -> UtteranceSpec:
    """What direct and contextual instructions end with."""
    if request.resolved:
        return UtteranceSpec("command", request.command(stated(request)))
    fields: Fields = {}
    for kind, parts in slot_types_in(request):
        fields |= kind.reduced(request, parts)
    return UtteranceSpec("command", request.command(fields))


def say(request: InstructionRequest) -> InstructionSpec:
    """Introduction and command."""
    return InstructionSpec((introduction(request), command(request)))


SETTING = Setting(
    name="direct",
    order=1,
    summary="an introduction names every value; the command points back at it",
    color="#0072B2",
    say=say,
    example=2,
)
