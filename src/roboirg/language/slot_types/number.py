"""Numbers of repetitions."""

from __future__ import annotations

from roboirg.core.word_pools import Pools
from roboirg.language.number_words import cardinal, times
from roboirg.language.phrases import MentionedValue, Phrase, anaphor, antecedent, fill
from roboirg.language.request import GoalValues, InstructionRequest
from roboirg.language.slot_types.slot_type import Fields, SlotType, competing_with, pointing_at
from roboirg.language.templates import introductions, remarks

MOST = 10
"""The largest number that a competing remark may name."""
SAME_NUMBER = Pools(
    train=("the same number of times", "just as many times"),
    test=("that same number of times", "that number of times"),
)
"""Words that fit once, too."""


def _stated(_request: InstructionRequest, goal_values: GoalValues) -> Fields:
    """Return ``three times``."""
    return {
        goal_value.field: antecedent(times(goal_value.number), goal_value)
        for goal_value in goal_values
    }


def _reduced(request: InstructionRequest, goal_values: GoalValues) -> Fields:
    """Return ``the same number of times``."""
    words = request.pick("same number", SAME_NUMBER)
    return {goal_value.field: anaphor(words, "that", goal_value) for goal_value in goal_values}


def _introduce(request: InstructionRequest, goal_values: GoalValues) -> Phrase:
    return introduce_quantity(request, goal_values[0].slot, goal_values[0].number)


def introduce_quantity(request: InstructionRequest, slot: str, quantity: int) -> Phrase:
    """Return a sentence that names a quantity."""
    template = request.pick("number introduction", introductions.NUMBER_INTRODUCTIONS)
    return fill(template, {"times": antecedent(times(quantity), MentionedValue(quantity, slot))})


competing = competing_with(
    remarks.COMPETING_NUMBER_DISTRACTORS, {one: cardinal(one) for one in range(1, MOST + 1)}
)
"""Returns remarks that name other numbers."""


NUMBER = SlotType(
    name="number",
    stated=_stated,
    reduced=_reduced,
    introduce=_introduce,
    pointing=pointing_at("number"),
    reinforcements=remarks.NUMBER_REINFORCEMENTS,
    competing=competing,
)
