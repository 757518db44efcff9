"""Numbers of repetitions."""

from __future__ import annotations

from roboirg.core.word_pools import Pools
from roboirg.language.number_words import cardinal, times
from roboirg.language.phrases import Phrase, anaphor, antecedent, fill
from roboirg.language.request import GoalValue, InstructionRequest
from roboirg.language.slot_types.slot_type import Fields, SlotType, competing_remarks
from roboirg.language.templates import introductions, remarks

COMPETING_NUMBERS = tuple(range(1, 11))
"""The numbers that a competing remark may name."""
SAME_NUMBER = Pools(
    train=("the same number of times", "just as many times"),
    test=("that same number of times", "that number of times"),
)
"""Words that fit once, too."""


def _stated(_request: InstructionRequest, goal_values: tuple[GoalValue, ...]) -> Fields:
    """Return ``three times``."""
    return {
        goal_value.field: antecedent(times(goal_value.number), goal_value.slot, goal_value.value)
        for goal_value in goal_values
    }


def _reduced(request: InstructionRequest, goal_values: tuple[GoalValue, ...]) -> Fields:
    """Return ``the same number of times``."""
    words = request.pick("same number", SAME_NUMBER)
    return {
        goal_value.field: anaphor(words, "that", goal_value.slot, goal_value.value)
        for goal_value in goal_values
    }


def _introduce(request: InstructionRequest, goal_values: tuple[GoalValue, ...]) -> Phrase:
    return introduce_quantity(request, goal_values[0].slot, goal_values[0].number)


def introduce_quantity(request: InstructionRequest, slot: str, quantity: int) -> Phrase:
    """Return a sentence that names a quantity."""
    template = request.pick("number introduction", introductions.NUMBER_INTRODUCTIONS)
    return fill(template, {"times": antecedent(times(quantity), slot, quantity)})


def _pointing(_request: InstructionRequest, goal_values: tuple[GoalValue, ...]) -> Phrase:
    return anaphor("that number", "that", goal_values[0].slot, goal_values[0].value)


def competing(request: InstructionRequest, goal_values: tuple[GoalValue, ...]) -> list[Phrase]:
    """Return remarks that name other numbers."""
    sentences = remarks.COMPETING_NUMBER_DISTRACTORS.of(request.pool)
    return competing_remarks(
        sentences, COMPETING_NUMBERS, lambda value: cardinal(int(value)), goal_values
    )


NUMBER = SlotType(
    name="number",
    stated=_stated,
    reduced=_reduced,
    introduce=_introduce,
    pointing=_pointing,
    reinforcements=remarks.NUMBER_REINFORCEMENTS,
    competing=competing,
)
