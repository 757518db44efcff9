"""Moments: right before or right after the button press in the video."""

from __future__ import annotations

from roboirg.language.instruction import Expression
from roboirg.language.phrases import Phrase, anaphor, antecedent, fill, plain
from roboirg.language.request import GoalValue, GoalValues, InstructionRequest
from roboirg.language.slot_types.slot_type import Fields, SlotType, competing_with, pointing_at
from roboirg.language.templates import derivations, introductions, remarks

EXPRESSIONS: dict[str, Expression] = {"at that moment": "that", "then": "then"}


def placed(goal_value: GoalValue, moment: Phrase) -> Fields:
    """Return ``the target used ...``.

    Not *it*: only one cube is placed in the video, so *it* would give the cube away.
    """
    return {goal_value.field: (*plain("the target used "), *moment)}


def named(goal_value: GoalValue) -> Phrase:
    """Return ``right before the button press``."""
    return antecedent(derivations.MOMENTS[str(goal_value.value)], goal_value)


def _stated(_request: InstructionRequest, goal_values: GoalValues) -> Fields:
    return placed(goal_values[0], named(goal_values[0]))


def _reduced(request: InstructionRequest, goal_values: GoalValues) -> Fields:
    """Return ``at that moment``, or ``then``."""
    (goal_value,) = goal_values
    words = request.sampler.pick("moment anaphor", derivations.MOMENT_ANAPHORS)
    return placed(goal_value, anaphor(words, EXPRESSIONS[words], goal_value))


def _introduce(request: InstructionRequest, goal_values: GoalValues) -> Phrase:
    template = request.pick("moment introduction", introductions.MOMENT_INTRODUCTIONS)
    return fill(template, {"moment": named(goal_values[0])})


RELATION = SlotType(
    name="relation",
    stated=_stated,
    reduced=_reduced,
    introduce=_introduce,
    pointing=pointing_at("moment"),
    reinforcements=remarks.VIDEO_REINFORCEMENTS,
    competing=competing_with(remarks.COMPETING_MOMENT_DISTRACTORS, derivations.MOMENTS),
)
