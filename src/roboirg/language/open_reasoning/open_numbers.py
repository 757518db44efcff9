"""Open number deduction: a relation to the total of two numbers, or to their difference."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Literal, NamedTuple

from roboirg.language.instruction import REFERENCE
from roboirg.language.number_words import CARDINALS, cardinal
from roboirg.language.open_reasoning import open_templates as templates
from roboirg.language.patterns.pattern import Derived, Pattern
from roboirg.language.phrases import Phrase, anaphor, antecedent, fill, plain
from roboirg.language.request import GoalValue, InstructionRequest
from roboirg.language.slot_types import Fields, amount
from roboirg.language.slot_types.ordinal import wrapped

LARGEST = len(CARDINALS) - 1
NUMBER_SLOTS = ("repeats", "counts", "visit", "placement")

Step = Literal["total", "difference"]


class Quantities(NamedTuple):
    """Two numbers, and what is made of them."""

    first: int
    second: int
    step: Step


def quantities(reference: int) -> list[Quantities]:
    """Return all pairs of different numbers with this total or difference, in both orders."""
    numbers = range(1, LARGEST + 1)
    return [
        Quantities(first, second, step)
        for first in numbers
        for second in numbers
        for step, found in _steps(first, second)
        if first != second and found == reference
    ]


def _steps(first: int, second: int) -> Iterator[tuple[Step, int]]:
    yield "total", first + second
    yield "difference", abs(first - second)


def _goal_value(request: InstructionRequest) -> GoalValue | None:
    """Return the goal's number; None if it has none, or several."""
    found = [one for one in request.goal_values if one.slot in NUMBER_SLOTS]
    return found[0] if len(found) == 1 else None


def relations(result: int, choices: set[int]) -> list[templates.TwoStepRelation]:
    """Return the relations that lead to a result without giving it away.

    Only those that lead to every number of the scene say nothing about it. *Twice* leads to even
    ones alone, and is used where there are several.
    """
    found: list[templates.TwoStepRelation] = []
    for relation in templates.TWO_STEP_RELATIONS:
        reached = {one for one in choices if _possible(relation, one)}
        if result in reached and (reached == choices or (relation.factor > 1 and len(reached) > 1)):
            found.append(relation)
    return found


def _possible(relation: templates.TwoStepRelation, result: int) -> bool:
    reference = relation.reference(result)
    return reference is not None and bool(quantities(reference))


def _relations(
    request: InstructionRequest, goal_value: GoalValue
) -> list[templates.TwoStepRelation]:
    choices = {number for one in request.alternative_numbers(goal_value.slot) for number in one[:1]}
    return relations(goal_value.number, choices)


def _allows(request: InstructionRequest) -> bool:
    goal_value = _goal_value(request)
    return goal_value is not None and bool(_relations(request, goal_value))


def _derive(request: InstructionRequest) -> Derived:
    goal_value = _goal_value(request)
    assert goal_value is not None  # noqa: S101 - `_allows`
    relation = request.sampler.pick("two-step relation", _relations(request, goal_value))
    reference = relation.reference(goal_value.number) or 0
    possible = quantities(reference)
    step = request.sampler.pick("step", sorted({one.step for one in possible}))
    chosen = request.sampler.pick("quantities", [one for one in possible if one.step == step])
    template = request.pick("two quantities", templates.TWO_QUANTITIES)
    context = fill(
        template,
        {
            "first": antecedent(cardinal(chosen.first), REFERENCE, chosen.first),
            "second": antecedent(cardinal(chosen.second), REFERENCE, chosen.second),
        },
    )
    notes: dict[str, object] = {
        "patterns": ["number deduction"],
        "relation": f"{relation.name}, {step}",
        "reference": [chosen.first, chosen.second],
    }
    pointer = _pointer(request, chosen, reference)
    return Derived(context, _fields(request, goal_value, relation, pointer), notes)


def _pointer(request: InstructionRequest, chosen: Quantities, reference: int) -> Phrase:
    pools = templates.TOTALS if chosen.step == "total" else templates.DIFFERENCES
    words = request.pick(chosen.step, pools)
    if not request.resolved:
        return anaphor(words, chosen.step, REFERENCE, reference)
    joint = "of" if chosen.step == "total" else "between"
    pair = f"{cardinal(chosen.first)} and {cardinal(chosen.second)}"
    return antecedent(f"the {chosen.step} {joint} {pair}", REFERENCE, reference)


def _fields(
    request: InstructionRequest,
    goal_value: GoalValue,
    relation: templates.TwoStepRelation,
    pointer: Phrase,
) -> Fields:
    if goal_value.slot == "repeats":
        return {goal_value.field: fill(relation.times, {"number": pointer})}
    if goal_value.slot == "counts":
        (color,) = request.color_values
        shade = antecedent(color.color, color.slot, color.value)
        return amount.amounts([fill(relation.cubes, {"color": shade, "number": pointer})])
    noun = plain(f"the {goal_value.slot_type} whose number is ")
    value = fill(relation.value, {"number": pointer})
    return wrapped(request, goal_value, (*noun, *value))


TWO_STEPS = Pattern(_allows, _derive)
