"""The two moments around the press of the button: the other one, or the neighbor."""

from __future__ import annotations

from roboirg.language import templates
from roboirg.language.patterns.pattern import REFERENCE, Derived, Pattern
from roboirg.language.phrases import Phrase, anaphor, antecedent, fill, plain
from roboirg.language.request import GoalValue, InstructionRequest
from roboirg.language.slot_types import relation

PAIR = "right before and right after the button press"


def _rejected(part: GoalValue) -> str:
    return next(one for one in templates.MOMENTS if one != part.value)


def _single(request: InstructionRequest, rejected: str) -> str:
    """The command's words for the moment or placement that is not meant."""
    return f"the one {templates.MOMENTS[rejected]}" if request.resolved else "that one"


def _other(request: InstructionRequest) -> Derived:
    """Of the two moments, not the one that somebody chose."""
    (part,) = request.parts_of("relation")
    rejected = _rejected(part)
    template = request.chooser.pick("two moments", templates.TWO_MOMENTS_INTRODUCTIONS)
    introduced: dict[str, Phrase] = {
        "pair": antecedent(PAIR, REFERENCE, " and ".join(templates.MOMENTS)),
        "single": antecedent(f"the one right {rejected} it", REFERENCE, rejected),
    }
    complement = request.chooser.pick("complement", templates.MOMENT_COMPLEMENTS)
    words = complement.format(single=_single(request, rejected))
    other = (
        antecedent(words, part.slot, part.value)
        if request.resolved
        else anaphor(words, "other", part.slot, part.value)
    )
    fields = relation.placed(part, (*plain("at "), *other))
    return Derived(fill(template, introduced), fields, {"patterns": ["contextual logic"]})


def _neighbor(request: InstructionRequest) -> Derived:
    """The placement that is next to another one; there are only these two."""
    (part,) = request.parts_of("relation")
    rejected = _rejected(part)
    template = request.chooser.pick("neighbor introduction", templates.NEIGHBOR_INTRODUCTIONS)
    context = fill(
        template, {"moment": antecedent(templates.MOMENTS[rejected], REFERENCE, rejected)}
    )
    words = _single(request, rejected)
    single = (
        antecedent(words, REFERENCE, rejected)
        if request.resolved
        else anaphor(words, "that", REFERENCE, rejected)
    )
    which = (*plain("the target of "), *fill(templates.NEIGHBOR, {"single": single}))
    notes: dict[str, object] = {
        "patterns": ["sequential relation"],
        "relation": "neighbor",
        "reference": rejected,
    }
    return Derived(context, {part.field: which}, notes)


def _allows(request: InstructionRequest) -> bool:
    return bool(request.parts_of("relation"))


OTHER = Pattern(_allows, _other)
NEIGHBOR = Pattern(_allows, _neighbor)
