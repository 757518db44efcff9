"""Moments: right before or right after the press of the button in the video."""

from __future__ import annotations

from roboirg.language import templates
from roboirg.language.instruction import Expression
from roboirg.language.phrases import Phrase, anaphor, antecedent, fill, plain
from roboirg.language.request import GoalValue, InstructionRequest
from roboirg.language.slot_types.slot_type import Fields, SlotType, rival_sentences

EXPRESSIONS: dict[str, Expression] = {"at that moment": "that", "then": "then"}


def placed(part: GoalValue, moment: Phrase) -> Fields:
    """``the target where a cube was placed ...``.

    Not *it*: only one cube is placed in the video, so that would tell which is meant.
    """
    return {part.field: (*plain("the target where a cube was placed "), *moment)}


def named(part: GoalValue) -> Phrase:
    """``right before the button press``."""
    return antecedent(templates.MOMENTS[str(part.value)], part.slot, part.value)


def _stated(_request: InstructionRequest, parts: tuple[GoalValue, ...]) -> Fields:
    return placed(parts[0], named(parts[0]))


def _reduced(request: InstructionRequest, parts: tuple[GoalValue, ...]) -> Fields:
    """``at that moment``, or ``then``."""
    (part,) = parts
    words = request.chooser.pick("moment anaphor", templates.MOMENT_ANAPHORS)
    return placed(part, anaphor(words, EXPRESSIONS[words], part.slot, part.value))


def _introduce(request: InstructionRequest, parts: tuple[GoalValue, ...]) -> Phrase:
    template = request.chooser.pick("moment introduction", templates.MOMENT_INTRODUCTIONS)
    return fill(template, {"moment": named(parts[0])})


def _pointing(_request: InstructionRequest, parts: tuple[GoalValue, ...]) -> Phrase:
    return anaphor("that moment", "that", parts[0].slot, parts[0].value)


def _rivals(_request: InstructionRequest, parts: tuple[GoalValue, ...]) -> list[Phrase]:
    values = tuple(templates.MOMENTS)
    sentences = templates.COMPETING_MOMENT_DISTRACTORS
    return rival_sentences(sentences, values, lambda value: templates.MOMENTS[str(value)], parts)


RELATION = SlotType(
    name="relation",
    stated=_stated,
    reduced=_reduced,
    introduce=_introduce,
    pointing=_pointing,
    reinforcements=templates.VIDEO_REINFORCEMENTS,
    rivals=_rivals,
)
