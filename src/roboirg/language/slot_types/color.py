"""Colors: which cube, box or tape, or the container over which cube."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from roboirg.language import templates
from roboirg.language.instruction import Expression
from roboirg.language.number_words import plural
from roboirg.language.phrases import Phrase, anaphor, antecedent, fill, listed
from roboirg.language.request import GoalValue, InstructionRequest
from roboirg.language.slot_types.slot_type import Fields, SlotType, rival_sentences

REDUCED: Mapping[int, tuple[tuple[str, Expression], ...]] = {
    1: (("it", "it"),),
    2: (("the former", "former"), ("the latter", "latter")),
    3: (("the first", "first"), ("the second", "second"), ("the third", "third")),
}
"""What points back at one, two or three introduced cubes."""


def named(request: InstructionRequest, part: GoalValue) -> Phrase:
    """``the red cube``."""
    noun = request.task.commands.colored
    return antecedent(f"the {part.color} {noun}", part.slot, part.value)


def _stated(request: InstructionRequest, parts: tuple[GoalValue, ...]) -> Fields:
    """``the red cube``, or the container that hides it."""
    return {part.field: request.by_color(named(request, part)) for part in parts}


def _reduced(request: InstructionRequest, parts: tuple[GoalValue, ...]) -> Fields:
    """``it``; ``the former`` and ``the latter``; ..."""
    return {
        part.field: request.by_color(anaphor(words, expression, part.slot, part.value))
        for part, (words, expression) in zip(parts, REDUCED[len(parts)], strict=True)
    }


def _introduce(request: InstructionRequest, parts: tuple[GoalValue, ...]) -> Phrase:
    template = request.chooser.pick("color introduction", templates.COLOR_INTRODUCTIONS)
    things = listed([named(request, part) for part in parts])
    return fill(template, {"things": things}, plural=len(parts) > 1)


def _pointing(request: InstructionRequest, parts: tuple[GoalValue, ...]) -> Phrase:
    if len(parts) == 1:
        words = f"that {request.task.commands.colored}"
        return anaphor(words, "that", parts[0].slot, parts[0].value)
    return those(request, parts)


def those(request: InstructionRequest, parts: tuple[GoalValue, ...]) -> Phrase:
    """A plural for the cubes, boxes or tapes of all colors."""
    values = " and ".join(part.color for part in parts)
    words = f"those {plural(request.task.commands.colored)}"
    return anaphor(words, "them", parts[0].slot, values)


def rivals(request: InstructionRequest, parts: tuple[GoalValue, ...]) -> list[Phrase]:
    """Remarks that name other colors."""
    colors = request.task.commands.colors
    return rival_sentences(templates.COMPETING_COLOR_DISTRACTORS, colors, str, parts)


def _described(parts: tuple[GoalValue, ...], things: Sequence[Phrase]) -> Fields:
    return {part.field: thing for part, thing in zip(parts, things, strict=True)}


COLOR = SlotType(
    name="color",
    stated=_stated,
    reduced=_reduced,
    introduce=_introduce,
    pointing=_pointing,
    reinforcements=templates.COLOR_REINFORCEMENTS,
    rivals=rivals,
    described=_described,
)
