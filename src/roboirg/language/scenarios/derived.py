"""Every way in which the goal of an episode can follow from something else, for reasoning.

The rules are those of `roboirg.language.patterns`; here they give values instead of words.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

from roboirg.language.instruction import REFERENCE
from roboirg.language.patterns.deduction import deductions
from roboirg.language.patterns.exclusion import excluded_colors
from roboirg.language.patterns.sequence import open_steps
from roboirg.language.request import GoalValue, InstructionRequest
from roboirg.language.rivals.value_pair import ValuePair, possible_pairs
from roboirg.language.scenarios.introduced import IntroducedValue, as_reference, several
from roboirg.language.slot_types.ordinal import series_length
from roboirg.language.templates import derivations

ALL_COLORS = 3
"""Shown colors, of which two can be excluded and then one of those be taken."""


class Derivation(NamedTuple):
    """One way.

    Attributes:
        pattern: of reasoning.
        relation: its name; None where the pattern has one only.
        fields: the fields of the command that follow.
        values: what is introduced, by slot.
        listed: of two values of which one is taken: the slot, else empty.
        patterns: all that take part.
    """

    pattern: str
    relation: str | None
    fields: tuple[str, ...]
    values: dict[str, tuple[IntroducedValue, ...]]
    listed: str = ""
    patterns: tuple[str, ...] = ()


def derivations_of(request: InstructionRequest) -> Iterator[Derivation]:
    """Yield the derivations of an episode; those of a pair are drawn."""
    yield from _deduced(request)
    for value in (*request.values_of("visit"), *request.values_of("placement")):
        yield from _stepped(request, value, "number deduction", derivations.COUNTED_STEPS)
        yield from _stepped(request, value, "sequential relation", derivations.STEPS)
    yield from _excluded(request)
    yield from _other(request)


def _deduced(request: InstructionRequest) -> Iterator[Derivation]:
    for value in request.values_of("number"):
        choices = request.alternative_numbers(value.slot)
        for relation, (reference,) in deductions([value.number], choices):
            values = _counted(as_reference(value, reference), relation.offset)
            yield Derivation("number deduction", relation.name, (value.field,), values)


def _stepped(
    request: InstructionRequest,
    value: GoalValue,
    pattern: str,
    known: tuple[derivations.Step, ...],
) -> Iterator[Derivation]:
    length = series_length(request, value)
    choices = [number for (number,) in request.alternative_numbers(value.slot)]
    for step in open_steps(known, value.number, length, choices):
        values = _counted(as_reference(value, value.number - step.offset), step.offset)
        yield Derivation(pattern, step.name, (value.field,), values)


def _counted(reference: IntroducedValue, offset: int) -> dict[str, tuple[IntroducedValue, ...]]:
    """Return a reference, and the step from there to the goal, without its direction."""
    step = IntroducedValue("", "number", abs(offset))
    return {"reference": (reference,), **({"step": (step,)} if offset else {})}


def _excluded(request: InstructionRequest) -> Iterator[Derivation]:
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
    fields = tuple(one.field for one in colors)
    yield Derivation("color exclusion", None, fields, values, patterns=tuple(patterns))


def _other(request: InstructionRequest) -> Iterator[Derivation]:
    """Yield for each slot a value as the other one of two, in an order that is drawn."""
    pairs = [pair for pair in possible_pairs(request) if not pair.ordered]
    for slot in dict.fromkeys(pair.slot for pair in pairs):
        of_slot = [pair for pair in pairs if pair.slot == slot]
        pair: ValuePair = request.sampler.pick(f"complement {slot}", of_slot)
        both = [IntroducedValue(REFERENCE, one.slot_type, one.value) for one in pair]
        first, second = request.sampler.pick("complement order", ((0, 1), (1, 0)))
        values = {**several("list", (both[first], both[second])), "taken": (both[1],)}
        yield Derivation("contextual logic", None, (pair.meant.field,), values, listed=slot)
