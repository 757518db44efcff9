"""Amounts: how many cubes of each of one, two or three colors."""

from __future__ import annotations

from collections.abc import Sequence

from roboirg.language import templates
from roboirg.language.instruction import Expression
from roboirg.language.number_words import cardinal
from roboirg.language.phrases import Phrase, anaphor, antecedent, fill, listed, plain
from roboirg.language.request import GoalValue, InstructionRequest
from roboirg.language.slot_types import color, number
from roboirg.language.slot_types.slot_type import Fields, SlotType

FIELD = "cubes"
"""All amounts together are one field of the command."""


def pairs(parts: tuple[GoalValue, ...]) -> tuple[tuple[GoalValue, GoalValue], ...]:
    """Each color with its count."""
    colors = [part for part in parts if part.slot == "colors"]
    counts = [part for part in parts if part.slot == "counts"]
    return tuple(zip(colors, counts, strict=True))


def amount(count: Phrase, thing: Phrase) -> Phrase:
    """``two`` and ``red cubes``."""
    return (*count, *plain(" "), *thing)


def cubes(shade: GoalValue, count: int) -> Phrase:
    """``red cube`` or ``red cubes``."""
    return antecedent(f"{shade.color} {noun(count)}", shade.slot, shade.value)


def noun(count: int) -> str:
    """``cube`` or ``cubes``."""
    return "cube" if count == 1 else "cubes"


def _count(part: GoalValue) -> Phrase:
    return antecedent(cardinal(part.number), part.slot, part.value)


def _stated(_request: InstructionRequest, parts: tuple[GoalValue, ...]) -> Fields:
    """``two red cubes and one blue cube``."""
    things = [cubes(shade, count.number) for shade, count in pairs(parts)]
    return _described(parts, things)


def _reduced(_request: InstructionRequest, parts: tuple[GoalValue, ...]) -> Fields:
    """``that many of them``; ``that many of the former and that many of the latter``; ..."""
    matched = pairs(parts)
    them: tuple[tuple[str, Expression], ...] = (("them", "them"),)
    pointers = them if len(matched) == 1 else color.REDUCED[len(matched)]
    items = [
        amount(
            anaphor("that many", "that", count.slot, count.value),
            anaphor(f"of {words}", expression, shade.slot, shade.value),
        )
        for (shade, count), (words, expression) in zip(matched, pointers, strict=True)
    ]
    return {FIELD: listed(items)}


def _introduce(request: InstructionRequest, parts: tuple[GoalValue, ...]) -> Phrase:
    template = request.chooser.pick("amount introduction", templates.AMOUNT_INTRODUCTIONS)
    # "One of the red cubes", so that "them" is right for a single one too.
    things = [
        (*_count(count), *plain(" of the "), *cubes(shade, 2)) for shade, count in pairs(parts)
    ]
    return fill(template, {"things": listed(things)})


def introduce_references(
    request: InstructionRequest, parts: tuple[GoalValue, ...], slot: str, quantities: Sequence[int]
) -> Phrase:
    """A sentence that names another quantity for each color."""
    purpose, options = "reference amounts", templates.REFERENCE_AMOUNT_INTRODUCTIONS
    things = [
        amount(antecedent(cardinal(quantity), slot, quantity), cubes(shade, quantity))
        for (shade, _), quantity in zip(pairs(parts), quantities, strict=True)
    ]
    return fill(request.chooser.pick(purpose, options), {"things": listed(things)})


def _pointing(request: InstructionRequest, parts: tuple[GoalValue, ...]) -> Phrase:
    return color.those(request, tuple(shade for shade, _ in pairs(parts)))


def _rivals(request: InstructionRequest, parts: tuple[GoalValue, ...]) -> list[Phrase]:
    return [*color.rivals(request, parts), *number.rivals(request, parts)]


def _described(parts: tuple[GoalValue, ...], things: Sequence[Phrase]) -> Fields:
    counts = [_count(count) for _, count in pairs(parts)]
    return {FIELD: listed([amount(*one) for one in zip(counts, things, strict=True)])}


AMOUNT = SlotType(
    name="amount",
    stated=_stated,
    reduced=_reduced,
    introduce=_introduce,
    pointing=_pointing,
    plural=lambda _parts: True,
    reinforcements=templates.COLOR_REINFORCEMENTS,
    rivals=_rivals,
    described=_described,
)
