"""Colors: which cube, box or tape to handle, or which cube's container.

The introduction names the goal's colors alone, or among others that the scene could ask for; then
the command takes them by their place in the list.
"""

from __future__ import annotations

import itertools
from collections.abc import Mapping, Sequence
from typing import NamedTuple

from roboirg.language.instruction import REFERENCE, Expression
from roboirg.language.number_words import plural
from roboirg.language.phrases import (
    MentionedValue,
    Phrase,
    anaphor,
    antecedent,
    fill,
    listed,
    plain,
)
from roboirg.language.request import GoalValue, GoalValues, InstructionRequest
from roboirg.language.slot_types.slot_type import Fields, SlotType, competing_with
from roboirg.language.templates import introductions, remarks

Pointer = tuple[str, Expression]
"""Words that point back, and their class."""
FORMER: tuple[Pointer, ...] = (("the former", "former"), ("the latter", "latter"))
RANKS: tuple[Pointer, ...] = (
    ("the first one", "first"), ("the second one", "second"), ("the third one", "third"),
)  # fmt: skip
LISTS: Mapping[int, tuple[Pointer, ...]] = {2: FORMER, 3: RANKS}
"""For two or three introduced things, in their order."""


def singles(noun: str) -> tuple[Pointer, ...]:
    """Return the words for the only thing that was introduced; the natural ones come up more."""
    own: tuple[Pointer, ...] = (("it", "it"), (f"that {noun}", "that"))
    return (*own, *own, ("the one I mentioned earlier", "one"))


class ColorReference(NamedTuple):
    """How the words point back at the goal's colors.

    Attributes:
        introduced: the colors that the introduction names, in its order.
        pointers: the words for each color of the goal.
    """

    introduced: tuple[str, ...]
    pointers: tuple[Pointer, ...]


def draw_reference(
    request: InstructionRequest,
    goal_values: GoalValues,
    single: Sequence[Pointer] | None = None,
) -> ColorReference:
    """Draw whether other colors are introduced, too, and the words that point back."""
    colors = tuple(goal_value.color for goal_value in goal_values)
    sizes = [size for size in LISTS if len(colors) < size <= len(request.scene_colors)]
    manners = ["alone", *(["list"] if sizes else [])]
    if request.sampler.pick("introduced colors", manners) == "alone":
        if len(colors) == 1:
            single = single or singles(request.task.commands.colored)
            return ColorReference(colors, (request.sampler.pick("color anaphor", single),))
        return ColorReference(colors, _pointers(request, len(colors)))
    size = request.sampler.pick("list length", sizes)
    others = [color for color in request.scene_colors if color not in colors]
    left = next(request.sampler.cycle("listed colors", list(itertools.permutations(others))))
    members = [*colors, *left[: size - len(colors)]]
    introduced = request.sampler.pick("list order", list(itertools.permutations(members)))
    pointers = _pointers(request, size)
    return ColorReference(introduced, tuple(pointers[introduced.index(one)] for one in colors))


def _pointers(request: InstructionRequest, size: int) -> tuple[Pointer, ...]:
    """Return the words for two or three listed things."""
    if size == len(RANKS) and request.task.commands.names_sides:
        # "The third one from your right" would be a place.
        return tuple((words.replace("one", "of them"), expression) for words, expression in RANKS)
    return LISTS[size]


def introduce_colors(
    request: InstructionRequest,
    goal_values: GoalValues,
    reference: ColorReference,
    *,
    many: bool = False,
) -> Phrase:
    """Return a sentence that names colors: ``I like the red, green and blue cubes``."""
    slots = {goal_value.color: goal_value.slot for goal_value in goal_values}
    colors = [
        antecedent(one, MentionedValue(one, slots.get(one, REFERENCE)))
        for one in reference.introduced
    ]
    several = many or len(colors) > 1
    noun = request.task.commands.colored
    things = (*plain("the "), *listed(colors), *plain(f" {plural(noun) if several else noun}"))
    template = request.pick("color introduction", introductions.COLOR_INTRODUCTIONS)
    return fill(template, {"things": things}, plural=several)


def named(request: InstructionRequest, goal_value: GoalValue) -> Phrase:
    """Return ``the red cube``."""
    noun = request.task.commands.colored
    return antecedent(f"the {goal_value.color} {noun}", goal_value)


def _stated(request: InstructionRequest, goal_values: GoalValues) -> Fields:
    """Return ``the red cube``, or words for the container over it."""
    return {
        goal_value.field: request.by_color(named(request, goal_value)) for goal_value in goal_values
    }


def _reduced(request: InstructionRequest, goal_values: GoalValues) -> Fields:
    """Return ``it``, ``the former`` and ``the latter``, or ``the first``, etc."""
    pointers = draw_reference(request, goal_values).pointers
    return {
        goal_value.field: request.by_color(anaphor(words, expression, goal_value))
        for goal_value, (words, expression) in zip(goal_values, pointers, strict=True)
    }


def _introduce(request: InstructionRequest, goal_values: GoalValues) -> Phrase:
    reference = draw_reference(request, goal_values)
    return introduce_colors(request, goal_values, reference)


def _pointing(request: InstructionRequest, goal_values: GoalValues) -> Phrase:
    introduced = draw_reference(request, goal_values).introduced
    if len(introduced) == 1:
        return anaphor("it", "it", goal_values[0])
    return them(goal_values, introduced)


def them(goal_values: GoalValues, introduced: tuple[str, ...]) -> Phrase:
    """Return a plural that refers to the things of all introduced colors."""
    slot = goal_values[0].slot if len(introduced) == len(goal_values) else REFERENCE
    return anaphor("them", "them", MentionedValue(" and ".join(introduced), slot))


def competing(request: InstructionRequest, goal_values: GoalValues) -> list[Phrase]:
    """Return remarks that name other colors."""
    words: dict[str, str] = {color: color for color in request.task.commands.colors}
    return competing_with(remarks.COMPETING_COLOR_DISTRACTORS, words)(request, goal_values)


def _described(
    _request: InstructionRequest, goal_values: GoalValues, things: Sequence[Phrase]
) -> Fields:
    return {goal_value.field: thing for goal_value, thing in zip(goal_values, things, strict=True)}


COLOR = SlotType(
    name="color",
    stated=_stated,
    reduced=_reduced,
    introduce=_introduce,
    pointing=_pointing,
    reinforcements=remarks.COLOR_REINFORCEMENTS,
    competing=competing,
    plural=lambda request, goal_values: len(draw_reference(request, goal_values).introduced) > 1,
    described=_described,
)
