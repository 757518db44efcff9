"""Sequential relation: an element of a series follows from its distance to another one."""

from __future__ import annotations

from collections.abc import Sequence

from roboirg.language.instruction import REFERENCE
from roboirg.language.number_words import ordinal as ordinal_word
from roboirg.language.patterns.pattern import Derived, Pattern
from roboirg.language.phrases import Phrase, anaphor, antecedent, fill, plain
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
    return _open_steps(derivations.STEPS, position, length, choices)


def _open_steps(
    known: Sequence[derivations.Step], position: int, length: int, choices: Sequence[int]
) -> list[derivations.Step]:
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
    """Return the steps of visits that are told as numbers: *one visit earlier than that*."""
    return [
        step
        for goal_value in request.values_of("visit")
        for step in _open_steps(
            derivations.COUNTED_STEPS,
            goal_value.number,
            ordinal.series_length(request, goal_value),
            _choices(request, goal_value),
        )
    ]


def _goal_value(request: InstructionRequest) -> GoalValue | None:
    return next(iter((*request.values_of("visit"), *request.values_of("placement"))), None)


def _allows(request: InstructionRequest) -> bool:
    goal_value = _goal_value(request)
    return goal_value is not None and bool(_steps(request, goal_value))


def _reference(request: InstructionRequest, position: int) -> Phrase:
    if request.resolved:
        return antecedent(f"the {ordinal_word(position)}", REFERENCE, position)
    return anaphor("that", "that", REFERENCE, position)


def _derived(
    request: InstructionRequest, pattern: str, step: derivations.Step, fields: Fields
) -> Derived:
    (goal_value,) = (*request.values_of("visit"), *request.values_of("placement"))
    position = goal_value.number - step.offset
    context = ordinal.introduce_position(request, goal_value, REFERENCE, position)
    notes = {"patterns": [pattern], "relation": step.name, "reference": position}
    return Derived(context, fields, notes)


def _ordinal(request: InstructionRequest) -> Derived:
    """Derive an element from its distance to another one: *right before that*."""
    (goal_value,) = (*request.values_of("visit"), *request.values_of("placement"))
    step = request.sampler.pick("relation", _steps(request, goal_value))
    reference = _reference(request, goal_value.number - step.offset)
    element = (
        *plain(f"the {goal_value.slot_type} "),
        *fill(step.words, {"reference": reference}),
    )
    fields = ordinal.wrapped(request, goal_value, element)
    return _derived(request, "sequential relation", step, fields)


def _counted(request: InstructionRequest) -> Derived:
    """Derive a visit from a number of visits: *one visit earlier than that*."""
    (goal_value,) = request.values_of("visit")
    step = request.sampler.pick("relation", _counted_steps(request))
    reference = _reference(request, goal_value.number - step.offset)
    words = request.around(goal_value.field, fill(step.words, {"reference": reference}))
    return _derived(request, "number deduction", step, {goal_value.field: words})


ORDINAL = Pattern(_allows, _ordinal)
COUNTED_VISIT = Pattern(lambda request: bool(_counted_steps(request)), _counted)
