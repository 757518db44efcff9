"""The explicit setting: one command states every slot."""

from __future__ import annotations

from roboirg.language.request import InstructionRequest, InstructionSpec, UtteranceSpec
from roboirg.language.settings.setting import Setting
from roboirg.language.slot_types import stated


def say(request: InstructionRequest) -> InstructionSpec:
    """Return the command alone."""
    return InstructionSpec((UtteranceSpec("command", request.command(stated(request))),))


SETTING = Setting(
    name="explicit",
    order=0,
    summary="one command states every value",
    color="#000000",
    say=say,
    implicit=False,
    reads=frozenset({"language"}),
    offers="explicit",
)
