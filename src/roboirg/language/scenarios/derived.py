"""Every way in which the goal of an episode can follow from something else, for reasoning.

Each is a content plan: what the introduction names, and for which fields of the command words such
as *one fewer than that* stand.

- *pattern*: the kind of reasoning, ``number deduction``.
- *relation*: how a number, or a position in a series, follows from another: *one fewer*.
- *reference*: the number, position or value from which the goal follows; it is introduced.
- *rival*: a value for which the goal could ask instead of its own.

No plan gives a value away: a relation is not used if its words spell the result, *one fewer* for
one, or if it can lead to a single goal of the scene only.
"""

from __future__ import annotations

import itertools
from collections.abc import Iterator, Sequence
from typing import NamedTuple

from roboirg.core.goal_slots import MOMENTS
from roboirg.core.motions import Shuttle
from roboirg.language.instruction import REFERENCE
from roboirg.language.request import GoalValue, GoalValues, InstructionRequest
from roboirg.language.rivals import ValuePair, possible_pairs
from roboirg.language.scenarios.fillers import (
    ContentPlan,
    Filler,
    FillersBySlot,
    filler_of,
    list_fillers,
)
from roboirg.language.scenarios.relations import (
    COUNTED_STEPS,
    NEIGHBOR,
    RELATIONS,
    STEPS,
    Relation,
)

PAIR = 2
"""Colors of which the second one is the other one."""
_POSITIONS = ("placement", "visit")
"""Slots whose values are positions in an order."""
MAX_REFERENCE = 10
"""The largest quantity to introduce."""


def derivations_of(request: InstructionRequest) -> Iterator[ContentPlan]:
    """Yield a content plan for every way in which the goal follows by some reasoning.

    *Leo ran three laps. Lift it one time fewer than that.* A content plan says what is introduced,
    here three, and for which fields of the command words such as *one time fewer than that* stand.
    Where two values are introduced, *red or blue*, which two and their order are drawn, so the
    order of the calls here must stay.
    """
    yield from _deduced_numbers(request)
    for value in (*request.values_of("visit"), *request.values_of("placement")):
        yield from _steps_in_series(request, value, "number deduction", COUNTED_STEPS)
        yield from _steps_in_series(request, value, "sequential relation", STEPS)
    for value in request.values_of("relation"):
        yield _other_moment(value)
    yield from _color_plans(request)
    yield from _other_ones(request)


def _other_moment(moment: GoalValue) -> ContentPlan:
    """Return the plan that names one moment and means the other one: ``before`` by ``after``.

    There are two, before and after the press of a button in the video.
    """
    (other,) = [name for name in MOMENTS if name != moment.value]
    values = {"reference": (Filler(REFERENCE, "relation", other),)}
    return _reasoning_plan("sequential relation", [moment.field], values, NEIGHBOR.name, other)


def _deduced_numbers(request: InstructionRequest) -> Iterator[ContentPlan]:
    """Yield a plan for each relation by which the goal's numbers follow from other numbers.

    The goal *twice* follows from 3 by *one fewer*. All counts of a goal follow by the same
    relation: 2 red and 1 blue from 3 red and 2 blue. A relation whose words spell the result is
    left out, *one fewer* for 1.
    """
    numbers = request.values_of("number") or request.values_in("counts")
    if not numbers:
        return
    first = numbers[0]  # all of them have its type
    results = [value.number for value in numbers]
    fields = [value.field for value in request.values_of(first.slot_type)]
    choices = request.alternatives(first.slot)
    for relation, references in deductions(results, choices):
        # Words for amounts need not name the number: "and Leo wants the same".
        is_unsaid = first.slot_type == "amount" and relation.name == "twice"
        if relation.spells in results and not is_unsaid:
            continue
        values = _reference_and_step(first, references, relation.offset)
        yield _reasoning_plan("number deduction", fields, values, relation.name, references[0])


class Deduction(NamedTuple):
    """How numbers follow from others: 2 and 1 as *one fewer* than 3 and 2.

    Attributes:
        relation: for all of them.
        references: the quantity from which each follows, ``[3, 2]``.
    """

    relation: Relation
    references: list[int]


def deductions(
    results: Sequence[int],
    choices: Sequence[Sequence[str | int]],
    known: Sequence[Relation] = RELATIONS,
    most: int = MAX_REFERENCE,
) -> Iterator[Deduction]:
    """Yield each relation that gives all of some results, with the number from which each follows.

    *One fewer* gives the results 2 and 1 from 3 and 2, and *two after* the third position from the
    first.

    Args:
        results: the goal's numbers, or its position in a series.
        choices: all results that are possible in the scene, each as `results`. A relation that can
            give only one of them would give the result away, so it is not yielded.
        known: the relations that words can say.
        most: the largest number from which they can follow: of positions, the length of the series.
    """
    for relation in known:
        references = _references(relation, results, most)
        reachable = [choice for choice in choices if _references(relation, choice, most)]
        if references and len(reachable) > 1:
            yield Deduction(relation, references)


def _references(relation: Relation, results: Sequence[str | int], most: int) -> list[int]:
    """Return the numbers from which some results follow; empty if one of them follows from none.

    By *one fewer*, 2 and 1 follow from 3 and 2. A number must be from 1 to `most`.
    """
    found = []
    for result in results:
        reference = relation.reference(int(result))
        if reference is None or not 1 <= reference <= most:
            return []
        found.append(reference)
    return found


def _steps_in_series(
    request: InstructionRequest,
    value: GoalValue,
    pattern: str,
    known: Sequence[Relation],
) -> Iterator[ContentPlan]:
    """Yield a plan for each step from another position in a series to the goal's position.

    The third of four visits follows from the second by *right after*, from the first by *two
    after*.

    Args:
        request: of the episode.
        value: the position, a visit or a placement.
        pattern: the name of this kind of reasoning, for the metadata.
        known: the steps that words can say.
    """
    choices = request.alternatives(value.slot)
    length = series_length(request, value)
    for step, references in deductions([value.number], choices, known, length):
        if step.spells != value.number:
            values = _reference_and_step(value, references, step.offset)
            yield _reasoning_plan(pattern, [value.field], values, step.name, references[0])


def series_length(request: InstructionRequest, value: GoalValue) -> int:
    """Return how many visits of the cube are to come, or how many placements the video shows.

    It is the length of the series in which `value`, a visit or a placement, is a position.
    """
    scene = request.episode.scene
    if value.slot_type == "visit":
        return sum(shuttle.passes for shuttle in scene.motions_of(Shuttle))
    targets = [target.name for target in scene.of_kind("target")]
    placements = [fact for fact in scene.past if fact.kind == "placed" and fact.place in targets]
    return len(placements)


def _reference_and_step(value: GoalValue, references: Sequence[int], offset: int) -> FillersBySlot:
    """Return what a scenario can name of a number that follows from others, by slot.

    2 follows from 3 with the offset -1: ``reference`` is 3 and ``step`` 1; the words of the
    scenario say the direction, *one fewer*. Without an offset, for *twice*, there is no step.

    Args:
        value: the number that follows; its type is that of the references.
        references: the number from which each number of the goal follows.
        offset: the result less the reference, 0 if it is a multiple.
    """
    reference_values = [Filler(REFERENCE, value.slot_type, number) for number in references]
    values = {**list_fillers("reference", reference_values)}
    if offset:
        values["step"] = (Filler("", "number", abs(offset)),)
    return values


def _color_plans(request: InstructionRequest) -> Iterator[ContentPlan]:
    """Yield the plan for a goal of one color, by exclusion, or of two, of which one is taken first.

    Nothing is yielded for other goals.
    """
    colors = request.color_values
    if len(colors) == 1:
        yield _color_left_over(request, colors[0])
    if len(colors) == PAIR:
        yield _second_of_two_colors(request, colors)


def _color_left_over(request: InstructionRequest, color: GoalValue) -> ContentPlan:
    """Return the plan that names all colors but the goal's: *not the red and not the blue one*."""
    excluded = [Filler(REFERENCE, "color", name) for name in excluded_colors(request)]
    return _reasoning_plan("color exclusion", [color.field], list_fillers("excluded", excluded))


def _second_of_two_colors(request: InstructionRequest, colors: GoalValues) -> ContentPlan:
    """Return the plan for a goal of two colors: the first one is taken, then the other one.

    *Red and blue are left. I take the red one first …*
    """
    both = [filler_of(color) for color in colors]
    fields = [color.field for color in colors]
    return _choice_of_two(request, both, both[0], fields, colors[0].slot)


def excluded_colors(request: InstructionRequest) -> tuple[str, ...]:
    """Draw the colors to exclude, so that only the first color of the goal is left.

    With red meant in a scene of red, blue and green: blue and green, in an order that is drawn. In
    a scene of a single color, one is named that nothing there has.
    """
    target = request.color_values[0].color
    others = [color for color in request.scene_colors if color != target]
    if not others:
        absent = [color for color in request.task.things.colors if color != target]
        return (request.sampler.pick("absent color", absent),)
    return request.sampler.pick("excluded colors", list(itertools.permutations(others)))


def _other_ones(request: InstructionRequest) -> Iterator[ContentPlan]:
    """Yield, for each slot of the goal that can have a second value, a plan of two values.

    *Red or blue? Not blue, the other one.* The second value, for which the goal could ask instead,
    is drawn for each slot.
    """
    by_slot: dict[str, list[ValuePair]] = {}
    for pair in possible_pairs(request):
        if not pair.is_ordered:
            by_slot.setdefault(pair.slot, []).append(pair)
    for slot, pairs in by_slot.items():
        yield _other_one(request, request.sampler.pick(f"complement {slot}", pairs))


def _other_one(request: InstructionRequest, pair: ValuePair) -> ContentPlan:
    """Return the plan that names the goal's value and its rival, and then that the rival is taken.

    For red with the rival blue: *red or blue; blue is taken*; so *the other one* is red.
    """
    kind = pair.meant.slot_type
    meant = Filler(REFERENCE, kind, pair.meant.value)
    rival = Filler(REFERENCE, kind, pair.rival.value)
    return _choice_of_two(request, [meant, rival], rival, [pair.meant.field], pair.slot)


def _choice_of_two(
    request: InstructionRequest,
    both: list[Filler],
    taken: Filler,
    fields: list[str],
    slot: str,
) -> ContentPlan:
    """Return the plan that lists two values and says that one of them is taken.

    The order of the two is drawn, but for positions: after *the second or first one*, *the first*
    could be the first of these two.

    Args:
        request: of the episode.
        both: the two values.
        taken: one of them; the other one is meant.
        fields: of the command, which says pronouns for them.
        slot: of the goal, of which the two are values.
    """
    orders = list(itertools.permutations(both))
    if slot in _POSITIONS:
        orders = [tuple(sorted(both, key=lambda filler: filler.value))]
    order = request.sampler.pick("complement order", orders)
    values = {**list_fillers("list", order), "taken": (taken,)}
    plan = _reasoning_plan("contextual logic", fields, values, reference=taken.value)
    candidates = [filler.value for filler in order]
    notes = {**plan.notes, "candidates": {slot: candidates}}
    return plan._replace(notes=notes, list_slot=slot)


def _reasoning_plan(
    pattern: str,
    fields: list[str],
    values: FillersBySlot,
    relation: str | None = None,
    reference: str | int | None = None,
) -> ContentPlan:
    """Return the content plan of a reasoning step, with its entries of the metadata.

    Args:
        pattern: the kind of reasoning, ``number deduction``.
        fields: of the command, which says words such as *one fewer than that* for them.
        values: what is introduced, by slot.
        relation: how the goal follows, ``one fewer``; None where nothing is computed.
        reference: the first value from which it follows, 3; None if it is what is left over.
    """
    notes = {
        "pattern": pattern,
        "patterns": [pattern],
        "relation": relation,
        "reference": reference,
    }
    return ContentPlan(fields, values, notes)
