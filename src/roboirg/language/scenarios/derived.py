"""Every way in which the goal of an episode can follow from something else, for reasoning.

The rules are those of `roboirg.language.patterns`; here they give values instead of words.
"""

from __future__ import annotations

from collections.abc import Iterator

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
    several,
)
from roboirg.language.slot_types.ordinal import series_length
from roboirg.language.templates import derivations

ALL_COLORS = 3
"""Shown colors, of which two can be excluded and then one of those be taken."""


def derivations_of(request: InstructionRequest) -> Iterator[Offer]:
    """Yield the derivations of an episode; those of a pair are drawn."""
    yield from _deduced(request)
    for value in (*request.values_of("visit"), *request.values_of("placement")):
        yield from _stepped(request, value, "number deduction", derivations.COUNTED_STEPS)
        yield from _stepped(request, value, "sequential relation", derivations.STEPS)
    yield from _excluded(request)
    yield from _other(request)


def _deduced(request: InstructionRequest) -> Iterator[Offer]:
    for value in request.values_of("number"):
        choices = request.alternative_numbers(value.slot)
        for relation, (reference,) in deductions([value.number], choices):
            values = _counted(value, reference, relation.offset)
            yield _derived(["number deduction"], [value.field], values, relation.name)


def _stepped(
    request: InstructionRequest,
    value: GoalValue,
    pattern: str,
    known: tuple[derivations.Step, ...],
) -> Iterator[Offer]:
    length = series_length(request, value)
    choices = [number for (number,) in request.alternative_numbers(value.slot)]
    for step in open_steps(known, value.number, length, choices):
        values = _counted(value, value.number - step.offset, step.offset)
        yield _derived([pattern], [value.field], values, step.name)


def _counted(value: GoalValue, reference: int, offset: int) -> Values:
    """Return a reference, and the step from there to the goal, without its direction."""
    step = {"step": (IntroducedValue("", "number", abs(offset)),)} if offset else {}
    return {"reference": (IntroducedValue(REFERENCE, value.slot_type, reference),), **step}


def _excluded(request: InstructionRequest) -> Iterator[Offer]:
    """Yield the color that is left without others, and a second one: of these, the other one."""
    colors = request.color_values
    fits = len(colors) == 1 or (len(colors), len(request.scene_colors)) == (2, ALL_COLORS)
    if request.values_of("amount") or not fits:
        return
    excluded = excluded_colors(request)
    values = {"excluded": tuple(IntroducedValue(REFERENCE, "color", one) for one in excluded)}
    patterns = ["color exclusion"]
    for second in colors[1:]:
        (taken,) = (one for one in excluded if one != second.value)
        values["taken"] = (IntroducedValue(REFERENCE, "color", taken),)
        patterns.append("contextual logic")
    yield _derived(patterns, [one.field for one in colors], values)


def _other(request: InstructionRequest) -> Iterator[Offer]:
    """Yield for each slot a value as the other one of two, in an order that is drawn."""
    pairs = [pair for pair in possible_pairs(request) if not pair.ordered]
    for slot in dict.fromkeys(pair.slot for pair in pairs):
        of_slot = [pair for pair in pairs if pair.slot == slot]
        pair: ValuePair = request.sampler.pick(f"complement {slot}", of_slot)
        both = [IntroducedValue(REFERENCE, one.slot_type, one.value) for one in pair]
        first, second = request.sampler.pick("complement order", ((0, 1), (1, 0)))
        values = {**several("list", (both[first], both[second])), "taken": (both[1],)}
        yield _derived(["contextual logic"], [pair.meant.field], values, listed=slot)


def _derived(
    patterns: list[str],
    fields: list[str],
    values: Values,
    relation: str | None = None,
    listed: str = "",
) -> Offer:
    """Return the offer of a derivation; the first pattern is its own, the others take part."""
    reference = values.get("reference", values.get("taken"))
    notes: dict[str, object] = {
        "pattern": patterns[0],
        "patterns": patterns,
        "relation": relation,
        "reference": reference[0].value if reference else None,
    }
    if listed:
        notes["candidates"] = {listed: [one.value for one in values["list"]]}
    return Offer(fields, values, notes, listed)
