"""Amounts: numbers of cubes of one, two or three colors."""

from __future__ import annotations

from collections.abc import Sequence

from roboirg.language.number_words import cardinal
from roboirg.language.phrases import (
    Mentionable,
    MentionedValue,
    Phrase,
    anaphor,
    antecedent,
    fill,
    listed,
    plain,
)
from roboirg.language.request import AMOUNT_FIELD, GoalValue, GoalValues, InstructionRequest
from roboirg.language.slot_types import color, number
from roboirg.language.slot_types.slot_type import Fields, SlotType
from roboirg.language.templates import introductions, remarks

THEM: tuple[color.Pointer, ...] = (("them", "them"),)


def pairs(goal_values: GoalValues) -> tuple[tuple[GoalValue, GoalValue], ...]:
    """Return each color with its count."""
    colors = [goal_value for goal_value in goal_values if goal_value.slot == "colors"]
    counts = [goal_value for goal_value in goal_values if goal_value.slot == "counts"]
    return tuple(zip(colors, counts, strict=True))


def amount(count: Phrase, thing: Phrase) -> Phrase:
    """Join a count and a thing: ``two red cubes``."""
    return (*count, *plain(" "), *thing)


def amounts(items: Sequence[Phrase]) -> Fields:
    """Return the field of the command for the words for each color with its count."""
    return {AMOUNT_FIELD: listed(items)}


def cubes(shade: GoalValue, count: int) -> Phrase:
    """Return ``red cube`` or ``red cubes``."""
    return antecedent(f"{shade.color} {noun(count)}", shade)


def noun(count: int) -> str:
    """Return ``cube`` or ``cubes``."""
    return "cube" if count == 1 else "cubes"


def _count(goal_value: GoalValue) -> Phrase:
    return antecedent(cardinal(goal_value.number), goal_value)


def _stated(request: InstructionRequest, goal_values: GoalValues) -> Fields:
    """Return ``two red cubes and one blue cube``, ``two red, one blue and one green cube``."""
    matched = pairs(goal_values)
    things = [cubes(shade, count.number) for shade, count in matched]
    if len(matched) > 2:  # noqa: PLR2004 - the noun of many stands at the end
        things[:-1] = [color_of(shade) for shade, _ in matched[:-1]]
    return _described(request, goal_values, things)


def _counts_said(request: InstructionRequest, goal_values: GoalValues) -> bool:
    """Draw whether the command says how many cubes, and points back at the color alone."""
    if len(pairs(goal_values)) > 1:
        return False
    return request.sampler.pick("said in the command", ("color", "count")) == "count"


def _color_reference(request: InstructionRequest) -> color.ColorReference:
    return color.draw_reference(request, request.values_in("colors"), THEM)


def _reduced(request: InstructionRequest, goal_values: GoalValues) -> Fields:
    """Return ``that many of them``, ``two of them``, or ``exactly those`` for several colors."""
    matched = pairs(goal_values)
    if len(matched) > 1:
        return {AMOUNT_FIELD: anaphor("exactly those", "them", all_colors(goal_values))}
    ((shade, count),) = matched
    if _counts_said(request, goal_values):
        ((words, expression),) = _color_reference(request).pointers
        thing = anaphor(f"of {words.replace(' one', ' color')}", expression, shade)
        return _described(request, goal_values, [thing])
    ((words, expression),) = THEM
    of_color = anaphor(f"of {words}", expression, shade)
    return amounts([amount(anaphor("that many", "that", count), of_color)])


def all_colors(goal_values: Sequence[GoalValue]) -> Mentionable:
    """Return what a mention of several colors stands for: ``red and green``."""
    colors = [value.color for value in goal_values if value.slot == "colors"]
    return MentionedValue(" and ".join(colors), "colors")


def _introduce(request: InstructionRequest, goal_values: GoalValues) -> Phrase:
    if _counts_said(request, goal_values):
        reference = _color_reference(request)
        shades = request.values_in("colors")
        return color.introduce_colors(request, shades, reference, many=True)
    template = request.pick("amount introduction", introductions.AMOUNT_INTRODUCTIONS)
    # "One of the red cubes": "them" then also fits a count of one.
    *others, last = pairs(goal_values)
    things = [(*_count(count), *plain(" of the "), *color_of(shade)) for shade, count in others]
    things.append((*_count(last[1]), *plain(" of the "), *cubes(last[0], 2)))
    return fill(template, {"things": listed(things)})


def color_of(shade: GoalValue) -> Phrase:
    """Return ``red``."""
    return antecedent(shade.color, shade)


def introduce_references(
    request: InstructionRequest,
    goal_values: GoalValues,
    slot: str,
    quantities: Sequence[int],
) -> Phrase:
    """Return a sentence that names a reference quantity for each color."""
    template = request.pick("reference amounts", introductions.REFERENCE_AMOUNT_INTRODUCTIONS)
    return fill(template, {"things": references(goal_values, slot, quantities)})


def references(goal_values: GoalValues, slot: str, quantities: Sequence[int]) -> Phrase:
    """Return ``six red and four blue cubes``, whose numbers only lead to the goal."""
    shades = [shade for shade, _ in pairs(goal_values)]
    nouns = [*map(color_of, shades[:-1]), cubes(shades[-1], quantities[-1])]
    return listed(
        [
            amount(antecedent(cardinal(quantity), MentionedValue(quantity, slot)), noun)
            for quantity, noun in zip(quantities, nouns, strict=True)
        ]
    )


def _pointing(request: InstructionRequest, goal_values: GoalValues) -> Phrase:
    shades = request.values_in("colors")
    introduced = tuple(shade.color for shade in shades)
    if _counts_said(request, goal_values):
        introduced = _color_reference(request).introduced
    return color.them(shades, introduced)


def _competing(request: InstructionRequest, goal_values: GoalValues) -> list[Phrase]:
    return [*color.competing(request, goal_values), *number.competing(request, goal_values)]


def _described(
    _request: InstructionRequest, goal_values: GoalValues, things: Sequence[Phrase]
) -> Fields:
    items: list[Phrase] = []
    for (_, count), thing in zip(pairs(goal_values), things, strict=True):
        items.append(amount(_count(count), thing))
    return amounts(items)


AMOUNT = SlotType(
    name="amount",
    stated=_stated,
    reduced=_reduced,
    introduce=_introduce,
    pointing=_pointing,
    plural=lambda _request, _parts: True,
    reinforcements=remarks.COLOR_REINFORCEMENTS,
    competing=_competing,
    described=_described,
)
