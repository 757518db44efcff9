"""Numbers of repetitions."""

from __future__ import annotations

from roboirg.language import templates
from roboirg.language.number_words import cardinal, times
from roboirg.language.phrases import Phrase, anaphor, antecedent, fill
from roboirg.language.request import GoalValue, InstructionRequest
from roboirg.language.slot_types.slot_type import Fields, SlotType, competing_remarks

COMPETING_NUMBERS = tuple(range(1, 11))
"""The numbers that a competing remark may name."""


def _stated(_request: InstructionRequest, goal_values: tuple[GoalValue, ...]) -> Fields:
    """Return ``three times``."""
    return {
        goal_value.field: antecedent(times(goal_value.number), goal_value.slot, goal_value.value)
        for goal_value in goal_values
    }


def _reduced(_request: InstructionRequest, goal_values: tuple[GoalValue, ...]) -> Fields:
    """Return ``that many times``."""
    return {
        goal_value.field: anaphor("that many times", "that", goal_value.slot, goal_value.value)
        for goal_value in goal_values
    }


def _introduce(request: InstructionRequest, goal_values: tuple[GoalValue, ...]) -> Phrase:
    return introduce_quantity(request, goal_values[0].slot, goal_values[0].number)


def introduce_quantity(request: InstructionRequest, slot: str, quantity: int) -> Phrase:
    """Return a sentence that names a quantity."""
    template = request.sampler.pick("number introduction", templates.NUMBER_INTRODUCTIONS)
    return fill(template, {"number": antecedent(cardinal(quantity), slot, quantity)})


def _pointing(_request: InstructionRequest, goal_values: tuple[GoalValue, ...]) -> Phrase:
    return anaphor("that number", "that", goal_values[0].slot, goal_values[0].value)


def competing(_request: InstructionRequest, goal_values: tuple[GoalValue, ...]) -> list[Phrase]:
    """Return remarks that name other numbers."""
    sentences = templates.COMPETING_NUMBER_DISTRACTORS
    return competing_remarks(
        sentences, COMPETING_NUMBERS, lambda value: cardinal(int(value)), goal_values
    )


NUMBER = SlotType(
    name="number",
    stated=_stated,
    reduced=_reduced,
    introduce=_introduce,
    pointing=_pointing,
    reinforcements=templates.NUMBER_REINFORCEMENTS,
    competing=competing,
)
