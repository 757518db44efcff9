"""Amounts: numbers of cubes of one, two or three colors."""

from __future__ import annotations

from collections.abc import Sequence

from roboirg.language import templates
from roboirg.language.instruction import Expression
from roboirg.language.number_words import cardinal
from roboirg.language.phrases import Phrase, anaphor, antecedent, fill, listed, plain
from roboirg.language.request import AMOUNT_FIELD, GoalValue, InstructionRequest
from roboirg.language.slot_types import color, number
from roboirg.language.slot_types.slot_type import Fields, SlotType


def pairs(goal_values: tuple[GoalValue, ...]) -> tuple[tuple[GoalValue, GoalValue], ...]:
    """Return each color with its count."""
    colors = [goal_value for goal_value in goal_values if goal_value.slot == "colors"]
    counts = [goal_value for goal_value in goal_values if goal_value.slot == "counts"]
    return tuple(zip(colors, counts, strict=True))


def amount(count: Phrase, thing: Phrase) -> Phrase:
    """Join a count and a thing: ``two red cubes``."""
    return (*count, *plain(" "), *thing)


def amounts(items: Sequence[Phrase]) -> Fields:
    """Return the fields of the command for the words for each color with its count."""
    single = {f"{AMOUNT_FIELD}.{index}": item for index, item in enumerate(items)}
    return {AMOUNT_FIELD: listed(items), **single}


def cubes(shade: GoalValue, count: int) -> Phrase:
    """Return ``red cube`` or ``red cubes``."""
    return antecedent(f"{shade.color} {noun(count)}", shade.slot, shade.value)


def noun(count: int) -> str:
    """Return ``cube`` or ``cubes``."""
    return "cube" if count == 1 else "cubes"


def _count(goal_value: GoalValue) -> Phrase:
    return antecedent(cardinal(goal_value.number), goal_value.slot, goal_value.value)


def _stated(request: InstructionRequest, goal_values: tuple[GoalValue, ...]) -> Fields:
    """Return ``two red cubes and one blue cube``."""
    things = [cubes(shade, count.number) for shade, count in pairs(goal_values)]
    return _described(request, goal_values, things)


def _reduced(request: InstructionRequest, goal_values: tuple[GoalValue, ...]) -> Fields:
    """Return ``that many of them``, or ``that many of the former and that many of the latter``."""
    matched = pairs(goal_values)
    them: tuple[tuple[str, Expression], ...] = (("them", "them"),)
    pointers = them if len(matched) == 1 else color.REDUCED[len(matched)]
    items = [
        amount(
            anaphor("that many", "that", count.slot, count.value),
            anaphor(f"of {words}", expression, shade.slot, shade.value),
        )
        for (shade, count), (words, expression) in zip(matched, pointers, strict=True)
    ]
    return amounts([(*item, *_after(request, at)) for at, item in enumerate(items)])


def _after(request: InstructionRequest, index: int) -> Phrase:
    """Return the words from outside that stay after the words for an amount."""
    outside = request.outside_phrase(f"{AMOUNT_FIELD}.{index}")
    return () if outside is None else plain(outside.after)


def _introduce(request: InstructionRequest, goal_values: tuple[GoalValue, ...]) -> Phrase:
    template = request.sampler.pick("amount introduction", templates.AMOUNT_INTRODUCTIONS)
    # "One of the red cubes": "them" then also fits a count of one.
    things = [
        (*_count(count), *plain(" of the "), *cubes(shade, 2))
        for shade, count in pairs(goal_values)
    ]
    return fill(template, {"things": listed(things)})


def introduce_references(
    request: InstructionRequest,
    goal_values: tuple[GoalValue, ...],
    slot: str,
    quantities: Sequence[int],
) -> Phrase:
    """Return a sentence that names a reference quantity for each color."""
    purpose, options = "reference amounts", templates.REFERENCE_AMOUNT_INTRODUCTIONS
    things = [
        amount(antecedent(cardinal(quantity), slot, quantity), cubes(shade, quantity))
        for (shade, _), quantity in zip(pairs(goal_values), quantities, strict=True)
    ]
    return fill(request.sampler.pick(purpose, options), {"things": listed(things)})


def _pointing(request: InstructionRequest, goal_values: tuple[GoalValue, ...]) -> Phrase:
    return color.those(request, tuple(shade for shade, _ in pairs(goal_values)))


def _competing(request: InstructionRequest, goal_values: tuple[GoalValue, ...]) -> list[Phrase]:
    return [*color.competing(request, goal_values), *number.competing(request, goal_values)]


def _described(
    request: InstructionRequest, goal_values: tuple[GoalValue, ...], things: Sequence[Phrase]
) -> Fields:
    items: list[Phrase] = []
    for index, ((_, count), thing) in enumerate(zip(pairs(goal_values), things, strict=True)):
        outside = request.outside_phrase(f"{AMOUNT_FIELD}.{index}")
        if outside is not None and outside.before:
            item = (*plain(outside.before), *thing)
        else:
            item = amount(_count(count), thing)
        items.append((*item, *_after(request, index)))
    return amounts(items)


AMOUNT = SlotType(
    name="amount",
    stated=_stated,
    reduced=_reduced,
    introduce=_introduce,
    pointing=_pointing,
    plural=lambda _parts: True,
    reinforcements=templates.COLOR_REINFORCEMENTS,
    competing=_competing,
    described=_described,
)
