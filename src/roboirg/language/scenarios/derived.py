"""Every way in which the goal of an episode can follow from something else, for reasoning.

- *pattern*: the kind of reasoning, ``number deduction``.
- *relation*: how a number, or a position in a series, follows from another: *one fewer*.
- *reference*: the number, position or value from which the goal follows; it is introduced.
- *complement*: a value as the other one of two, of which one is taken.

No derivation gives a value away: a relation is not used if its words spell the result, *one fewer*
for one, or if it can lead to a single goal of the scene only.
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
from roboirg.language.scenarios.introduced import (
    IntroducedValue,
    Offer,
    Values,
    named,
    several,
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


def derivations_of(request: InstructionRequest) -> Iterator[Offer]:
    """Yield every way in which the goal can follow from something else, by some reasoning.

    Such a way, an offer, has what is introduced, *three laps*, and the fields of the command that
    point back at it, *one fewer than that*. Offers of two values are drawn.
    """
    yield from _deduced(request)
    for value in (*request.values_of("visit"), *request.values_of("placement")):
        yield from _stepped(request, value, "number deduction", COUNTED_STEPS)
        yield from _stepped(request, value, "sequential relation", STEPS)
    for value in request.values_of("relation"):
        yield _neighboring(value)
    yield from _colored(request)
    yield from _complements(request)


def _neighboring(moment: GoalValue) -> Offer:
    """Return the moment that is next to the other one in time, whichever comes first."""
    (other,) = [name for name in MOMENTS if name != moment.value]
    reference = IntroducedValue(REFERENCE, "relation", other)
    values = {"reference": (reference,)}
    return _offer_of("sequential relation", [moment.field], values, NEIGHBOR.name)


def _deduced(request: InstructionRequest) -> Iterator[Offer]:
    """Yield the goal's numbers as they follow from others: 2 as *one fewer than* 3.

    All counts of a goal follow by the same relation: 2 red and 1 blue from 3 red and 2 blue. A
    relation whose words spell the result is left out, *one fewer* for 1.
    """
    numbers = request.values_of("number") or request.values_in("counts")
    if not numbers:
        return
    first = numbers[0]  # all of them have its type
    results = [value.number for value in numbers]
    fields = [value.field for value in request.values_of(first.slot_type)]
    choices = request.alternative_numbers(first.slot)
    for relation, references in deductions(results, choices):
        # Words for amounts need not name the number: "and Leo wants the same".
        is_unsaid = first.slot_type == "amount" and relation.name == "twice"
        if relation.spells in results and not is_unsaid:
            continue
        values = _counted(first, references, relation.offset)
        yield _offer_of("number deduction", fields, values, relation.name)


class Deduction(NamedTuple):
    """How numbers follow from others.

    Attributes:
        relation: for all of them.
        references: the quantity from which each follows.
    """

    relation: Relation
    references: list[int]


def deductions(
    results: Sequence[int],
    choices: Sequence[Sequence[int]],
    known: Sequence[Relation] = RELATIONS,
    most: int = MAX_REFERENCE,
) -> Iterator[Deduction]:
    """Yield each relation that gives all of some results, with the number from which each follows.

    *One fewer* gives the results 2 and 1 from 3 and 2, and *two after* the third position from the
    first.

    Args:
        results: the goal's numbers, or its position in a series.
        choices: all results that are possible in the scene. A relation that can give only one
            of them would give the result away.
        known: the relations that words can say.
        most: the largest number from which they can follow: of positions, the length of the series.
    """
    for relation in known:
        references = _references(relation, results, most)
        reachable = [choice for choice in choices if _references(relation, choice, most)]
        if references and len(reachable) > 1:
            yield Deduction(relation, references)


def _references(relation: Relation, results: Sequence[int], most: int) -> list[int]:
    """Return the numbers from which some results follow; empty if one follows from none.

    By *one fewer*, 2 and 1 follow from 3 and 2.
    """
    found: list[int] = []
    for result in results:
        reference = relation.reference(result)
        if reference is None or not 1 <= reference <= most:
            return []
        found.append(reference)
    return found


def _stepped(
    request: InstructionRequest,
    value: GoalValue,
    pattern: str,
    known: Sequence[Relation],
) -> Iterator[Offer]:
    """Yield a position in a series as it follows from another: *right after* the second.

    Args:
        request: of the episode.
        value: the position, a visit or a placement.
        pattern: the name of this kind of reasoning.
        known: the steps that words can say.
    """
    choices = request.alternative_numbers(value.slot)
    length = series_length(request, value)
    for step, references in deductions([value.number], choices, known, length):
        if step.spells != value.number:
            values = _counted(value, references, step.offset)
            yield _offer_of(pattern, [value.field], values, step.name)


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


def _counted(value: GoalValue, references: Sequence[int], offset: int) -> Values:
    """Return what is introduced for a number that follows: the reference, and the step to it.

    For 2 as one fewer than 3, the reference is 3 and the step 1; words say the direction.
    """
    reference_values = [
        IntroducedValue(REFERENCE, value.slot_type, number) for number in references
    ]
    values = {**several("reference", reference_values)}
    if offset:
        values["step"] = (IntroducedValue("", "number", abs(offset)),)
    return values


def _colored(request: InstructionRequest) -> Iterator[Offer]:
    """Yield the color that is left without others; of two colors that one is the other one."""
    colors = request.color_values
    if len(colors) == 1:
        yield _remaining(request, colors[0])
    if len(colors) == PAIR:
        yield _second_of(request, colors)


def _remaining(request: InstructionRequest, color: GoalValue) -> Offer:
    """Return the color that is left when others are excluded."""
    excluded = [IntroducedValue(REFERENCE, "color", name) for name in excluded_colors(request)]
    return _offer_of("color exclusion", [color.field], several("excluded", excluded))


def _second_of(request: InstructionRequest, colors: GoalValues) -> Offer:
    """Return the two colors of a goal, of which the first one is taken."""
    both = [named(color) for color in colors]
    fields = [color.field for color in colors]
    return _offer_of_two(request, both, both[0], fields, colors[0].slot)


def excluded_colors(request: InstructionRequest) -> tuple[str, ...]:
    """Return the colors to exclude, so that only the first color of the goal is left.

    With red meant in a scene of red, blue and green: blue and green, in an order that is drawn. In
    a scene of a single color, one is named that nothing there has.
    """
    target = request.color_values[0].color
    others = [color for color in request.scene_colors if color != target]
    if not others:
        absent = request.sampler.pick("absent color", request.other_colors(target))
        return (absent,)
    return request.sampler.pick("excluded colors", list(itertools.permutations(others)))


def _complements(request: InstructionRequest) -> Iterator[Offer]:
    """Yield, for each slot that can have a second value, the meant one as *the other one* of two.

    The second value and the order of the two are drawn: *red or blue? Not blue, the other one.*
    """
    by_slot: dict[str, list[ValuePair]] = {}
    for pair in possible_pairs(request):
        if not pair.is_ordered:
            by_slot.setdefault(pair.slot, []).append(pair)
    for slot, pairs in by_slot.items():
        yield _complement(request, request.sampler.pick(f"complement {slot}", pairs))


def _complement(request: InstructionRequest, pair: ValuePair) -> Offer:
    """Return a value as the other one of two, of which the rival is taken."""
    kind = pair.meant.slot_type
    meant = IntroducedValue(REFERENCE, kind, pair.meant.value)
    rival = IntroducedValue(REFERENCE, kind, pair.rival.value)
    return _offer_of_two(request, [meant, rival], rival, [pair.meant.field], pair.slot)


def _offer_of_two(
    request: InstructionRequest,
    both: list[IntroducedValue],
    taken: IntroducedValue,
    fields: list[str],
    slot: str,
) -> Offer:
    """Return the offer, a way to lead to the goal, of two values of which one is taken.

    The order of the two is drawn, but for positions: after *the second or first one*, *the first*
    could be the first of these two.

    Args:
        request: of the episode.
        both: the two values.
        taken: one of them; the other one is meant.
        fields: of the command, that point back.
        slot: of which the two are listed.
    """
    orders = list(itertools.permutations(both))
    if slot in _POSITIONS:
        orders = [tuple(sorted(both, key=lambda introduced: introduced.value))]
    order = request.sampler.pick("complement order", orders)
    values = {**several("list", order), "taken": (taken,)}
    return _offer_of("contextual logic", fields, values, listed=slot)


def _offer_of(
    pattern: str,
    fields: list[str],
    values: Values,
    relation: str | None = None,
    listed: str = "",
) -> Offer:
    """Return the offer of a derivation, with what the metadata say of it.

    Args:
        pattern: the kind of reasoning, ``number deduction``.
        fields: of the command, that point back.
        values: what is introduced.
        relation: its name, ``one fewer``; None without one.
        listed: the slot of which two values are listed; empty if none are.
    """
    reference = values.get("reference") or values.get("taken")
    notes: dict[str, object] = {
        "pattern": pattern,
        "patterns": [pattern],
        "relation": relation,
        "reference": reference[0].value if reference else None,
    }
    if listed:
        notes["candidates"] = {listed: [candidate.value for candidate in values["list"]]}
    return Offer(fields, values, notes, listed)
