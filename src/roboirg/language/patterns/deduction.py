"""Number deduction: a number follows from its relation to another quantity."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from typing import NamedTuple

from roboirg.core.goal_slots import SlotTypeName
from roboirg.language.instruction import REFERENCE
from roboirg.language.number_words import cardinal
from roboirg.language.patterns.pattern import Derived, Pattern
from roboirg.language.phrases import MentionedValue, Phrase, anaphor, antecedent, fill, words_of
from roboirg.language.request import AMOUNT_FIELD, GoalValues, InstructionRequest
from roboirg.language.slot_types import amount
from roboirg.language.slot_types.number import introduce_quantity
from roboirg.language.templates import derivations


class Deduction(NamedTuple):
    """A relation, and the quantity from which it gives each result."""

    relation: derivations.Relation
    references: tuple[int, ...]


def deductions(
    results: Sequence[int], choices: Sequence[Sequence[int]], unspelled: Collection[str] = ()
) -> list[Deduction]:
    """Return the relations that give all of these results, each from a quantity of its own.

    Args:
        results: the goal's numbers.
        choices: all results that are possible in the scene. A relation that can give only one
            of them would give the result away.
        unspelled: names of relations whose words do not contain the number that they spell.
    """
    found: list[Deduction] = []
    for relation in derivations.RELATIONS:
        references = tuple(_reference(relation, result) for result in results)
        if any(reference is None for reference in references):
            continue
        is_spelled = relation.spells in results and relation.name not in unspelled
        if is_spelled or not _open(relation, choices):
            continue
        found.append(Deduction(relation, tuple(one for one in references if one is not None)))
    return found


def _reference(relation: derivations.Relation, result: int) -> int | None:
    reference = relation.reference(result)
    if reference is None or not 1 <= reference <= derivations.MAX_REFERENCE:
        return None
    return None if result == reference else reference


def _open(relation: derivations.Relation, choices: Sequence[Sequence[int]]) -> bool:
    reachable = [
        choice
        for choice in choices
        if all(_reference(relation, number) is not None for number in choice)
    ]
    return len(reachable) > 1


def _deductions(request: InstructionRequest) -> list[Deduction]:
    slot = "counts" if request.values_of("amount") else "repeats"
    results = [value.number for value in request.values_in(slot)]
    return deductions(results, request.alternative_numbers(slot))


def _possible(request: InstructionRequest, slot_type: SlotTypeName) -> bool:
    return bool(request.values_of(slot_type)) and bool(_deductions(request))


def _chosen(request: InstructionRequest) -> Deduction:
    return request.sampler.pick("relation", _deductions(request))


def _pointer(request: InstructionRequest, number: int) -> Phrase:
    return request.refer("that", "that", MentionedValue(number), resolved=cardinal(number))


def _notes(deduction: Deduction) -> dict[str, object]:
    first, *others = deduction.references
    return {
        "patterns": ["number deduction"],
        "relation": deduction.relation.name,
        "reference": [first, *others] if others else first,
    }


def _times(request: InstructionRequest) -> Derived:
    (goal_value,) = request.values_of("number")
    deduction = _chosen(request)
    (number,) = deduction.references
    words = fill(deduction.relation.times, {"number": _pointer(request, number)})
    context = introduce_quantity(request, REFERENCE, number)
    return Derived(context, {goal_value.field: words}, _notes(deduction))


def _amounts(request: InstructionRequest) -> Derived:
    """Derive all counts by one relation, each from its own quantity."""
    goal_values = request.values_of("amount")
    deduction = _chosen(request)
    context = amount.introduce_references(request, goal_values, REFERENCE, deduction.references)
    matched = amount.pairs(goal_values)
    items = [
        fill(
            deduction.relation.cubes,
            {"color": amount.color_of(shade), "number": _pointer(request, number)},
        )
        for (shade, _), number in zip(matched, deduction.references, strict=True)
    ]
    fields = amount.amounts(items)
    if len(matched) > 1:
        fields[AMOUNT_FIELD] = _of_each(request, goal_values, deduction)
    return Derived(context, fields, _notes(deduction))


def _of_each(request: InstructionRequest, goal_values: GoalValues, deduction: Deduction) -> Phrase:
    """Return ``half as many of each``; resolved, ``of each as six red and four blue cubes``."""
    relation, colors = deduction.relation, amount.all_colors(goal_values)
    if not request.resolved:
        return fill(relation.each, {"number": anaphor("of each", "each", colors)})
    quantities = amount.references(goal_values, REFERENCE, deduction.references)
    words = f"of each {relation.than} {words_of(quantities)}"
    return fill(relation.each, {"number": antecedent(words, colors)})


TIMES = Pattern(lambda request: _possible(request, "number"), _times)
AMOUNTS = Pattern(lambda request: _possible(request, "amount"), _amounts)
