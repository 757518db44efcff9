"""Sequential relation: an element of a series follows from its distance to another one."""

from __future__ import annotations

from collections.abc import Sequence

from roboirg.language.instruction import REFERENCE
from roboirg.language.number_words import ordinal as ordinal_word
from roboirg.language.patterns.pattern import Derived, Pattern
from roboirg.language.phrases import MentionedValue, Phrase, fill, plain
from roboirg.language.request import GoalValue, InstructionRequest
from roboirg.language.slot_types import Fields, ordinal
from roboirg.language.templates import derivations


def steps(position: int, length: int, choices: Sequence[int]) -> list[derivations.Step]:
    """Return the steps that lead to a position from another one of the series.

    Args:
        position: position in the goal.
        length: length of the series.
        choices: all positions that are possible in the scene. A step that leads to only one of
            them would give it away.
    """
    if length == 2:  # noqa: PLR2004
        # Of two, the one right after the other is always the last: name both directions.
        return [derivations.NEIGHBORS[position]]
    return open_steps(derivations.STEPS, position, length, choices)


def open_steps(
    known: Sequence[derivations.Step], position: int, length: int, choices: Sequence[int]
) -> list[derivations.Step]:
    """Return those of the known steps that lead to a position and do not give it away."""
    return [
        step
        for step in known
        if step.spells != position
        and _leads(step, position, length)
        and sum(_leads(step, choice, length) for choice in choices) > 1
    ]


def _leads(step: derivations.Step, position: int, length: int) -> bool:
    return 1 <= position - step.offset <= length


def _choices(request: InstructionRequest, goal_value: GoalValue) -> list[int]:
    return [number for (number,) in request.alternative_numbers(goal_value.slot)]


def _steps(request: InstructionRequest, goal_value: GoalValue) -> list[derivations.Step]:
    length = ordinal.series_length(request, goal_value)
    return steps(goal_value.number, length, _choices(request, goal_value))


def _counted_steps(request: InstructionRequest) -> list[derivations.Step]:
    """Return the steps that are said as numbers: *one visit earlier than that*."""
    return [
        step
        for goal_value in _goal_values(request)
        for step in open_steps(
            derivations.COUNTED_STEPS,
            goal_value.number,
            ordinal.series_length(request, goal_value),
            _choices(request, goal_value),
        )
    ]


def _goal_values(request: InstructionRequest) -> list[GoalValue]:
    """Return the goal's visit or placement, if it has one."""
    return [*request.values_of("visit"), *request.values_of("placement")]


def _reference(request: InstructionRequest, position: int) -> Phrase:
    named = f"the {ordinal_word(position)}"
    return request.refer("that", "that", MentionedValue(position), resolved=named)


def _derived(
    request: InstructionRequest, pattern: str, step: derivations.Step, fields: Fields
) -> Derived:
    (goal_value,) = _goal_values(request)
    position = goal_value.number - step.offset
    context = ordinal.introduce_position(request, goal_value, REFERENCE, position)
    notes = {"patterns": [pattern], "relation": step.name, "reference": position}
    return Derived(context, fields, notes)


def _ordinal(request: InstructionRequest) -> Derived:
    """Derive an element from its distance: *right before that*."""
    (goal_value,) = _goal_values(request)
    step = request.sampler.pick("relation", _steps(request, goal_value))
    reference = _reference(request, goal_value.number - step.offset)
    element = (
        *plain(f"the {goal_value.slot_type} "),
        *fill(step.words, {"reference": reference}),
    )
    fields = ordinal.wrapped(goal_value, element)
    return _derived(request, "sequential relation", step, fields)


def _counted(request: InstructionRequest) -> Derived:
    """Derive an element from a number of others: *one visit earlier than that*."""
    (goal_value,) = _goal_values(request)
    step = request.sampler.pick("relation", _counted_steps(request))
    noun = plain(goal_value.slot_type)
    reference = _reference(request, goal_value.number - step.offset)
    words = fill(step.words, {"noun": noun, "reference": reference})
    if goal_value.slot_type == "placement":
        words = (*plain("the target used "), *words)
    fields = {goal_value.field: words}
    return _derived(request, "number deduction", step, fields)


ORDINAL = Pattern(
    lambda request: any(_steps(request, one) for one in _goal_values(request)), _ordinal
)
COUNTED = Pattern(lambda request: bool(_counted_steps(request)), _counted)
