"""Direct with a rival: two values are introduced alike, and the last words choose."""

from __future__ import annotations

from roboirg.language.request import InstructionRequest, InstructionSpec
from roboirg.language.rivals import (
    draw_pair,
    pair_command,
    pair_introduction,
    pair_notes,
    pair_refusal,
)
from roboirg.language.settings import direct
from roboirg.language.settings.setting import Setting


def say(request: InstructionRequest) -> InstructionSpec:
    """Return an introduction of both values, and a command after the words that choose."""
    pair = draw_pair(request)
    utterances = pair_introduction(request, pair), pair_command(request, pair)
    return InstructionSpec(utterances, pair_notes(pair))


SETTING = Setting(
    name="direct-rival",
    order=direct.SETTING.order,
    summary="direct, with a second value of the same kind; the last words single one out",
    color="#56B4E9",
    say=say,
    refusal=pair_refusal,
    reads=direct.SETTING.reads,
    example=2,
    plain=direct.SETTING.name,
    offers="direct-rival",
)
