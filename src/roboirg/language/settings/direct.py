"""The direct setting: an introduction names every value, and the command points back."""

from __future__ import annotations

from collections.abc import Iterator

from roboirg.core.episode import Goal
from roboirg.core.instruction_options import RIVALS, InstructionOptions
from roboirg.core.word_pools import POOLS
from roboirg.language.instruction import Instruction
from roboirg.language.phrases import sentences
from roboirg.language.request import InstructionRequest, InstructionSpec, UtteranceSpec
from roboirg.language.rivals import (
    draw_pair,
    hidden_by_pair,
    pair_command,
    pair_introduction,
    pair_notes,
    pair_refusal,
    wants_pair,
)
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
    if wants_pair(request):
        pair = draw_pair(request)
        utterances = pair_introduction(request, pair), pair_command(request, pair)
        return InstructionSpec(utterances, pair_notes(pair))
    return InstructionSpec((introduction(request), command(request)))


def hidden_slots(instruction: Instruction, goal: Goal) -> frozenset[str]:
    """Return the slot with a rival, as the command states the others; without a rival, all."""
    return hidden_by_pair(instruction) or frozenset(goal.as_mapping())


def _pairing_rules(instruct: Instruct) -> Iterator[str]:
    introduction = instruct(InstructionOptions("direct")).turns[0]
    explicit = instruct(InstructionOptions("explicit")).command
    resolved = instruct(InstructionOptions("direct", "resolved"))
    outside = resolved.metadata["wordings"] not in (None, *POOLS)
    paired = not outside or resolved.metadata["command"] != "own"
    if paired and resolved.turns != (introduction, explicit):
        yield "resolved, its command is not the explicit one"


SETTING = Setting(
    name="direct",
    order=1,
    summary="an introduction names every value; the command points back at it",
    color="#0072B2",
    say=say,
    refusal=pair_refusal,
    hidden_slots=hidden_slots,
    reads=frozenset({"delivery", "rival"}),
    variants=({}, {"rival": RIVALS[-1]}),
    pairing_rules=_pairing_rules,
    example=2,
)
