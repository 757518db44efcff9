"""Counts: how often something is to be done."""

from __future__ import annotations

from roboirg.language import templates
from roboirg.language.kinds.kind import Kind
from roboirg.language.phrases import Phrase, anaphor, antecedent, fill
from roboirg.language.request import Part, Request
from roboirg.language.words import cardinal, times


def named(_request: Request, part: Part) -> Phrase:
    """``three times``."""
    return antecedent(times(part.number), part.slot, part.value)


def reduced(_request: Request, parts: tuple[Part, ...]) -> dict[str, Phrase]:
    """``that many times``."""
    return {part.field: anaphor("that many times", "that", part.slot, part.value) for part in parts}


def introduce(request: Request, parts: tuple[Part, ...]) -> Phrase:
    """A sentence that names the number."""
    return introduce_quantity(request, parts[0].slot, parts[0].number)


def introduce_quantity(request: Request, slot: str, quantity: int) -> Phrase:
    """A sentence that names any quantity."""
    template = request.chooser.pick("number introduction", templates.NUMBER_INTRODUCTIONS)
    return fill(template, {"number": antecedent(cardinal(quantity), slot, quantity)})


def _pointing(parts: tuple[Part, ...]) -> Phrase:
    return anaphor("that number", "that", parts[0].slot, parts[0].value)


KIND = Kind(
    name="number",
    named=named,
    reduced=reduced,
    introduce=introduce,
    pointing=_pointing,
    reinforcements=templates.NUMBER_REINFORCEMENTS,
    competitors=templates.COMPETING_NUMBER_DISTRACTORS,
    values=tuple(range(1, 11)),
    word=lambda value: cardinal(int(value)),
)
