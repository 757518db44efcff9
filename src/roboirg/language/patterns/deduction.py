"""Number deduction: a number by its relation to another quantity."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

from roboirg.language import templates
from roboirg.language.number_words import cardinal
from roboirg.language.patterns.pattern import REFERENCE, Derived, Pattern
from roboirg.language.phrases import Phrase, anaphor, antecedent, fill, listed
from roboirg.language.request import GoalValue, InstructionRequest, SlotTypeName
from roboirg.language.slot_types import amount, ordinal
from roboirg.language.slot_types.number import introduce_quantity

NUMBER_SLOTS = ("repeats", "visit", "counts")


class Deduction(NamedTuple):
    """A relation, and for each result the quantity that it starts from."""

    relation: templates.Relation
    references: tuple[int, ...]


def deductions(results: Sequence[int], choices: Sequence[Sequence[int]]) -> list[Deduction]:
    """The relations that give all of these results, each from a quantity of its own.

    Args:
        results: the goal's numbers.
        choices: what somebody could want instead; a relation that only one of them can come from
            would give the result away.
    """
    found: list[Deduction] = []
    for relation in templates.RELATIONS:
        references = tuple(_reference(relation, result) for result in results)
        if any(reference is None for reference in references):
            continue
        if relation.spells in results or not _open(relation, choices):
            continue
        found.append(Deduction(relation, tuple(one for one in references if one is not None)))
    return found


def _reference(relation: templates.Relation, result: int) -> int | None:
    reference = relation.reference(result)
    if reference is None or not 1 <= reference <= templates.MAX_REFERENCE:
        return None
    return None if result == reference else reference


def _open(relation: templates.Relation, choices: Sequence[Sequence[int]]) -> bool:
    reachable = [
        choice
        for choice in choices
        if all(_reference(relation, number) is not None for number in choice)
    ]
    return len(reachable) > 1


def _deductions(request: InstructionRequest) -> list[Deduction]:
    (slot,) = {part.slot for part in request.parts if part.slot in NUMBER_SLOTS}
    results = [part.number for part in request.parts if part.slot == slot]
    return deductions(results, request.numbers_instead(slot))


def _possible(request: InstructionRequest, kind: SlotTypeName) -> bool:
    return bool(request.parts_of(kind)) and bool(_deductions(request))


def _chosen(request: InstructionRequest) -> Deduction:
    return request.chooser.pick("relation", _deductions(request))


def _pointer(request: InstructionRequest, number: int) -> Phrase:
    if request.resolved:
        return antecedent(cardinal(number), REFERENCE, number)
    return anaphor("that", "that", REFERENCE, number)


def _notes(deduction: Deduction) -> dict[str, object]:
    first, *more = deduction.references
    return {
        "patterns": ["number deduction"],
        "relation": deduction.relation.name,
        "reference": [first, *more] if more else first,
    }


def _times(request: InstructionRequest) -> Derived:
    (part,) = request.parts_of("number")
    deduction = _chosen(request)
    (number,) = deduction.references
    words = fill(deduction.relation.times, {"number": _pointer(request, number)})
    context = introduce_quantity(request, REFERENCE, number)
    return Derived(context, {part.field: words}, _notes(deduction))


def _visit(request: InstructionRequest) -> Derived:
    (part,) = request.parts_of("visit")
    deduction = _chosen(request)
    (number,) = deduction.references
    value = fill(deduction.relation.value, {"number": _pointer(request, number)})
    context = introduce_quantity(request, REFERENCE, number)
    return Derived(context, ordinal.by_number(part, value), _notes(deduction))


def _amounts(request: InstructionRequest) -> Derived:
    """The same relation for each color, each with its own quantity."""
    parts = request.parts_of("amount")
    deduction = _chosen(request)
    items = [
        fill(
            deduction.relation.cubes,
            {"color": _shade(shade), "number": _pointer(request, number)},
        )
        for (shade, _), number in zip(amount.pairs(parts), deduction.references, strict=True)
    ]
    context = amount.introduce_references(request, parts, REFERENCE, deduction.references)
    return Derived(context, {amount.FIELD: listed(items)}, _notes(deduction))


def _shade(part: GoalValue) -> Phrase:
    return antecedent(part.color, part.slot, part.value)


TIMES = Pattern(lambda request: _possible(request, "number"), _times)
AMOUNTS = Pattern(lambda request: _possible(request, "amount"), _amounts)
VISIT = Pattern(lambda request: _possible(request, "visit"), _visit)
