"""Sequential relation: an element of a series follows from its distance to another one."""

from __future__ import annotations

from collections.abc import Sequence

from roboirg.language import templates
from roboirg.language.number_words import ordinal as ordinal_word
from roboirg.language.patterns.pattern import REFERENCE, Derived, Pattern
from roboirg.language.phrases import anaphor, antecedent, fill, plain
from roboirg.language.request import GoalValue, InstructionRequest
from roboirg.language.slot_types import ordinal


def steps(position: int, length: int, choices: Sequence[int]) -> list[templates.Step]:
    """Return the steps that lead to a position from another one of the series.

    Args:
        position: position in the goal.
        length: length of the series.
        choices: all positions that are possible in the scene. A step that leads to only one of
            them would give it away.
    """
    if length == 2:  # noqa: PLR2004
        # Of two, the one right after the other is always the last: say neighbor instead.
        return [templates.NEIGHBORS[position]]
    return [
        step
        for step in templates.STEPS
        if step.spells != position
        and _leads(step, position, length)
        and sum(_leads(step, choice, length) for choice in choices) > 1
    ]


def _leads(step: templates.Step, position: int, length: int) -> bool:
    return 1 <= position - step.offset <= length


def _steps(request: InstructionRequest, goal_value: GoalValue) -> list[templates.Step]:
    length = ordinal.series_length(request, goal_value)
    choices = [number for (number,) in request.alternative_numbers(goal_value.slot)]
    return steps(goal_value.number, length, choices)


def _goal_value(request: InstructionRequest) -> GoalValue | None:
    return next(iter((*request.values_of("visit"), *request.values_of("placement"))), None)


def _allows(request: InstructionRequest) -> bool:
    goal_value = _goal_value(request)
    return goal_value is not None and bool(_steps(request, goal_value))


def _derive(request: InstructionRequest) -> Derived:
    (goal_value,) = (*request.values_of("visit"), *request.values_of("placement"))
    step = request.sampler.pick("relation", _steps(request, goal_value))
    position = goal_value.number - step.offset
    reference = (
        antecedent(f"the {ordinal_word(position)}", REFERENCE, position)
        if request.resolved
        else anaphor("that", "that", REFERENCE, position)
    )
    element = (
        *plain(f"the {ordinal.series_noun(request, goal_value)} "),
        *fill(step.words, {"reference": reference}),
    )
    notes: dict[str, object] = {
        "patterns": ["sequential relation"],
        "relation": step.name,
        "reference": position,
    }
    context = ordinal.introduce_position(request, goal_value, REFERENCE, position)
    return Derived(context, ordinal.wrapped(request, goal_value, element), notes)


ORDINAL = Pattern(_allows, _derive)
