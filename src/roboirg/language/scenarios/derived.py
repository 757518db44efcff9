"""Every way in which the goal of an episode can follow from something else, for reasoning.

The rules are those of `roboirg.language.patterns`; here they give values instead of words.
"""

from __future__ import annotations

import itertools
from collections.abc import Iterator, Sequence

from roboirg.language.instruction import REFERENCE
from roboirg.language.patterns.deduction import deductions
from roboirg.language.patterns.exclusion import excluded_colors
from roboirg.language.patterns.sequence import open_steps
from roboirg.language.request import GoalValue, InstructionRequest
from roboirg.language.rivals.value_pair import ValuePair, possible_pairs
from roboirg.language.scenarios.introduced import (
    IntroducedValue,
    Offer,
    Values,
    named,
    several,
)
from roboirg.language.slot_types.ordinal import series_length
from roboirg.language.templates import derivations

PAIR = 2
"""Colors of which the second one is the other one."""


def derivations_of(request: InstructionRequest) -> Iterator[Offer]:
    """Yield the derivations of an episode; those of a pair are drawn."""
    yield from _deduced(request)
    for value in (*request.values_of("visit"), *request.values_of("placement")):
        yield from _stepped(request, value, "number deduction", derivations.COUNTED_STEPS)
        yield from _stepped(request, value, "sequential relation", derivations.STEPS)
    yield from _colored(request)
    yield from _other(request)


def _deduced(request: InstructionRequest) -> Iterator[Offer]:
    """Yield the number as it follows from another one; counts all by one relation."""
    numbers = request.values_of("number") or request.values_in("counts")
    if not numbers:
        return
    slot, kind = numbers[0].slot, numbers[0].slot_type
    fields = [value.field for value in request.values_of(kind)]
    results, choices = [number.number for number in numbers], request.alternative_numbers(slot)
    # Words for amounts need not name the number: "and Leo wants the same".
    unspelled = ["twice"] if kind == "amount" else []
    for relation, references in deductions(results, choices, unspelled):
        values = _counted(numbers[0], references, relation.offset)
        yield _derived("number deduction", fields, values, relation.name)


def _stepped(
    request: InstructionRequest,
    value: GoalValue,
    pattern: str,
    known: tuple[derivations.Step, ...],
) -> Iterator[Offer]:
    length = series_length(request, value)
    choices = [number for (number,) in request.alternative_numbers(value.slot)]
    for step in open_steps(known, value.number, length, choices):
        values = _counted(value, [value.number - step.offset], step.offset)
        yield _derived(pattern, [value.field], values, step.name)


def _counted(value: GoalValue, references: Sequence[int], offset: int) -> Values:
    """Return references, and the step from there to the goal, without its direction."""
    step = {"step": (IntroducedValue("", "number", abs(offset)),)} if offset else {}
    known = [IntroducedValue(REFERENCE, value.slot_type, number) for number in references]
    return {**several("reference", known), **step}


def _colored(request: InstructionRequest) -> Iterator[Offer]:
    """Yield the color that is left without others; of two colors that one is the other one."""
    colors = request.color_values
    if len(colors) == 1:
        excluded = [IntroducedValue(REFERENCE, "color", one) for one in excluded_colors(request)]
        yield _derived("color exclusion", [colors[0].field], several("excluded", excluded))
    if len(colors) == PAIR:
        both = [named(one) for one in colors]
        yield _one_of(request, both, both[0], [one.field for one in colors], colors[0].slot)


def _other(request: InstructionRequest) -> Iterator[Offer]:
    """Yield for each slot a value as the other one of two, in an order that is drawn."""
    pairs = [pair for pair in possible_pairs(request) if not pair.ordered]
    for slot in dict.fromkeys(pair.slot for pair in pairs):
        of_slot = [pair for pair in pairs if pair.slot == slot]
        pair: ValuePair = request.sampler.pick(f"complement {slot}", of_slot)
        both = [IntroducedValue(REFERENCE, one.slot_type, one.value) for one in pair]
        yield _one_of(request, both, both[1], [pair.meant.field], slot)


def _one_of(
    request: InstructionRequest,
    both: list[IntroducedValue],
    taken: IntroducedValue,
    fields: list[str],
    slot: str,
) -> Offer:
    """Return the offer of two values in an order that is drawn, and of the one that is taken."""
    order = request.sampler.pick("complement order", list(itertools.permutations(both)))
    values = {**several("list", order), "taken": (taken,)}
    return _derived("contextual logic", fields, values, listed=slot)


def _derived(
    pattern: str,
    fields: list[str],
    values: Values,
    relation: str | None = None,
    listed: str = "",
) -> Offer:
    """Return the offer of a derivation."""
    reference = values.get("reference", values.get("taken"))
    notes: dict[str, object] = {
        "pattern": pattern,
        "patterns": [pattern],
        "relation": relation,
        "reference": reference[0].value if reference else None,
    }
    if listed:
        notes["candidates"] = {listed: [one.value for one in values["list"]]}
    return Offer(fields, values, notes, listed)
