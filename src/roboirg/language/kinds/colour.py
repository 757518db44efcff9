"""Colours: which cube, or the container over which cube."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from roboirg.episode import COLOURS
from roboirg.language import templates
from roboirg.language.instruction import Expression
from roboirg.language.kinds.kind import Fields, Kind, rival_sentences
from roboirg.language.phrases import Phrase, anaphor, antecedent, fill, listed
from roboirg.language.request import Part, Request

REDUCED: Mapping[int, tuple[tuple[str, Expression], ...]] = {
    1: (("it", "it"),),
    2: (("the former", "former"), ("the latter", "latter")),
    3: (("the first", "first"), ("the second", "second"), ("the third", "third")),
}
"""What points back at one, two or three introduced cubes."""


def cube(part: Part) -> Phrase:
    """``the red cube``."""
    return antecedent(f"the {part.colour} cube", part.slot, part.value)


def _stated(request: Request, parts: tuple[Part, ...]) -> Fields:
    """``the red cube``, or the container that hides it."""
    return {part.field: request.by_colour(cube(part)) for part in parts}


def _reduced(request: Request, parts: tuple[Part, ...]) -> Fields:
    """``it``; ``the former`` and ``the latter``; ..."""
    return {
        part.field: request.by_colour(anaphor(words, expression, part.slot, part.value))
        for part, (words, expression) in zip(parts, REDUCED[len(parts)], strict=True)
    }


def _introduce(request: Request, parts: tuple[Part, ...]) -> Phrase:
    template = request.chooser.pick("colour introduction", templates.COLOUR_INTRODUCTIONS)
    things = listed([cube(part) for part in parts])
    return fill(template, {"things": things}, plural=len(parts) > 1)


def _pointing(parts: tuple[Part, ...]) -> Phrase:
    if len(parts) == 1:
        return anaphor("that cube", "that", parts[0].slot, parts[0].value)
    return those_cubes(parts)


def those_cubes(parts: tuple[Part, ...]) -> Phrase:
    """A plural for the cubes of all colours."""
    values = " and ".join(part.colour for part in parts)
    return anaphor("those cubes", "them", parts[0].slot, values)


def rivals(parts: tuple[Part, ...]) -> list[Phrase]:
    """Remarks that name other colours."""
    return rival_sentences(templates.COMPETING_COLOUR_DISTRACTORS, COLOURS, str, parts)


def _described(parts: tuple[Part, ...], things: Sequence[Phrase]) -> Fields:
    return {part.field: thing for part, thing in zip(parts, things, strict=True)}


KIND = Kind(
    name="colour",
    stated=_stated,
    reduced=_reduced,
    introduce=_introduce,
    pointing=_pointing,
    reinforcements=templates.COLOUR_REINFORCEMENTS,
    rivals=rivals,
    described=_described,
)
