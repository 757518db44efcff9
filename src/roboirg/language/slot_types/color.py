"""Colors: which cube, box or tape to handle, or which cube's container."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from roboirg.language.instruction import Expression
from roboirg.language.number_words import plural
from roboirg.language.phrases import Phrase, anaphor, antecedent, fill, listed
from roboirg.language.request import GoalValue, InstructionRequest
from roboirg.language.slot_types.slot_type import Fields, SlotType, competing_remarks
from roboirg.language.templates import introductions, remarks

REDUCED: Mapping[int, tuple[tuple[str, Expression], ...]] = {
    1: (("it", "it"),),
    2: (("the former", "former"), ("the latter", "latter")),
    3: (("the first", "first"), ("the second", "second"), ("the third", "third")),
}
"""The words that point back at one, two or three introduced cubes."""


def named(request: InstructionRequest, goal_value: GoalValue) -> Phrase:
    """Return ``the red cube``."""
    noun = request.task.commands.colored
    return antecedent(f"the {goal_value.color} {noun}", goal_value.slot, goal_value.value)


def _stated(request: InstructionRequest, goal_values: tuple[GoalValue, ...]) -> Fields:
    """Return ``the red cube``, or words for the container over it."""
    return {
        goal_value.field: request.by_color(goal_value, named(request, goal_value))
        for goal_value in goal_values
    }


def _reduced(request: InstructionRequest, goal_values: tuple[GoalValue, ...]) -> Fields:
    """Return ``it``, ``the former`` and ``the latter``, or ``the first``, etc."""
    return {
        goal_value.field: request.by_color(
            goal_value, anaphor(words, expression, goal_value.slot, goal_value.value)
        )
        for goal_value, (words, expression) in zip(
            goal_values, REDUCED[len(goal_values)], strict=True
        )
    }


def _introduce(request: InstructionRequest, goal_values: tuple[GoalValue, ...]) -> Phrase:
    template = request.pick("color introduction", introductions.COLOR_INTRODUCTIONS)
    *others, last = goal_values
    shades = [antecedent(f"the {one.color}", one.slot, one.value) for one in others]
    things = listed([*shades, named(request, last)])
    return fill(template, {"things": things}, plural=len(goal_values) > 1)


def _pointing(request: InstructionRequest, goal_values: tuple[GoalValue, ...]) -> Phrase:
    if len(goal_values) == 1:
        words = f"that {request.task.commands.colored}"
        return anaphor(words, "that", goal_values[0].slot, goal_values[0].value)
    return those(request, goal_values)


def those(request: InstructionRequest, goal_values: tuple[GoalValue, ...]) -> Phrase:
    """Return a plural that refers to the things of all colors of the goal."""
    values = " and ".join(goal_value.color for goal_value in goal_values)
    words = f"those {plural(request.task.commands.colored)}"
    return anaphor(words, "them", goal_values[0].slot, values)


def competing(request: InstructionRequest, goal_values: tuple[GoalValue, ...]) -> list[Phrase]:
    """Return remarks that name other colors."""
    colors = request.task.commands.colors
    sentences = remarks.COMPETING_COLOR_DISTRACTORS.of(request.pool)
    return competing_remarks(sentences, colors, str, goal_values)


def _described(
    _request: InstructionRequest, goal_values: tuple[GoalValue, ...], things: Sequence[Phrase]
) -> Fields:
    return {goal_value.field: thing for goal_value, thing in zip(goal_values, things, strict=True)}


COLOR = SlotType(
    name="color",
    stated=_stated,
    reduced=_reduced,
    introduce=_introduce,
    pointing=_pointing,
    reinforcements=remarks.COLOR_REINFORCEMENTS,
    competing=competing,
    described=_described,
)
