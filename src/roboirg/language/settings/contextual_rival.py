"""Contextual with a rival: two values are introduced alike; the last words single one out."""

from __future__ import annotations

from roboirg.core.instruction_options import DEFAULT_DISTRACTOR
from roboirg.language.request import STAGE_SETS, InstructionRequest, InstructionSpec
from roboirg.language.rivals import (
    draw_pair,
    pair_command,
    pair_introduction,
    pair_notes,
    pair_refusal,
    pair_reinforcement,
)
from roboirg.language.settings import contextual
from roboirg.language.settings.setting import Setting

LONGEST = 3
"""Words of a distractor and of a cue; the command has a remark before it."""


def say(request: InstructionRequest) -> InstructionSpec:
    """Return the requested stages; a competing distractor would name one value too many."""
    pair = draw_pair(request)
    said = contextual.discourse(
        request,
        lambda asked: pair_introduction(asked, pair),
        lambda asked: pair_reinforcement(asked, pair),
        lambda asked: pair_command(asked, pair),
        DEFAULT_DISTRACTOR,
        LONGEST,
    )
    return InstructionSpec(said.utterances, {**said.notes, **pair_notes(pair)})


SETTING = Setting(
    name="contextual-rival",
    order=contextual.SETTING.order,
    summary="contextual, with a second value of the same kind; the last words single one out",
    color="#117733",
    say=say,
    refusal=pair_refusal,
    reads=contextual.SETTING.reads - {"distractor"},
    variants=tuple({"stages": stages} for stages in STAGE_SETS),
    example=1,
    plain=contextual.SETTING.name,
)
