"""Counts: how often something is to be done."""

from __future__ import annotations

from roboirg.language import templates
from roboirg.language.number_words import cardinal, times
from roboirg.language.phrases import Phrase, anaphor, antecedent, fill
from roboirg.language.request import GoalValue, InstructionRequest
from roboirg.language.slot_types.slot_type import Fields, SlotType, rival_sentences

RIVALS = tuple(range(1, 11))
"""Numbers that a remark may name."""


def _stated(_request: InstructionRequest, parts: tuple[GoalValue, ...]) -> Fields:
    """``three times``."""
    return {part.field: antecedent(times(part.number), part.slot, part.value) for part in parts}


def _reduced(_request: InstructionRequest, parts: tuple[GoalValue, ...]) -> Fields:
    """``that many times``."""
    return {part.field: anaphor("that many times", "that", part.slot, part.value) for part in parts}


def _introduce(request: InstructionRequest, parts: tuple[GoalValue, ...]) -> Phrase:
    return introduce_quantity(request, parts[0].slot, parts[0].number)


def introduce_quantity(request: InstructionRequest, slot: str, quantity: int) -> Phrase:
    """A sentence that names any quantity."""
    template = request.chooser.pick("number introduction", templates.NUMBER_INTRODUCTIONS)
    return fill(template, {"number": antecedent(cardinal(quantity), slot, quantity)})


def _pointing(_request: InstructionRequest, parts: tuple[GoalValue, ...]) -> Phrase:
    return anaphor("that number", "that", parts[0].slot, parts[0].value)


def rivals(_request: InstructionRequest, parts: tuple[GoalValue, ...]) -> list[Phrase]:
    """Remarks that name other numbers."""
    sentences = templates.COMPETING_NUMBER_DISTRACTORS
    return rival_sentences(sentences, RIVALS, lambda value: cardinal(int(value)), parts)


NUMBER = SlotType(
    name="number",
    stated=_stated,
    reduced=_reduced,
    introduce=_introduce,
    pointing=_pointing,
    reinforcements=templates.NUMBER_REINFORCEMENTS,
    rivals=rivals,
)
