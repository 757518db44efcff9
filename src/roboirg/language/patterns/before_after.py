"""Patterns of the two moments around the button press: the other moment, or the neighbor."""

from __future__ import annotations

from roboirg.language import templates
from roboirg.language.patterns.pattern import REFERENCE, Derived, Pattern
from roboirg.language.phrases import Phrase, anaphor, antecedent, fill, plain
from roboirg.language.request import GoalValue, InstructionRequest, NoCommandError
from roboirg.language.slot_types import relation

PAIR = "right before and right after the button press"


def _rejected(goal_value: GoalValue) -> str:
    return next(one for one in templates.MOMENTS if one != goal_value.value)


def _single(request: InstructionRequest, rejected: str) -> str:
    """Return the command's words for the moment or placement that is not meant."""
    return f"the one {templates.MOMENTS[rejected]}" if request.resolved else "that one"


def _other(request: InstructionRequest) -> Derived:
    """Derive a moment: of the two, the one that was not chosen."""
    (goal_value,) = request.values_of("relation")
    rejected = _rejected(goal_value)
    template = request.sampler.pick("two moments", templates.TWO_MOMENTS_INTRODUCTIONS)
    introduced: dict[str, Phrase] = {
        "pair": antecedent(PAIR, REFERENCE, " and ".join(templates.MOMENTS)),
        "single": antecedent(f"the one right {rejected} it", REFERENCE, rejected),
    }
    complement = request.sampler.pick("complement", templates.MOMENT_COMPLEMENTS)
    words = complement.format(single=_single(request, rejected))
    other = (
        antecedent(words, goal_value.slot, goal_value.value)
        if request.resolved
        else anaphor(words, "other", goal_value.slot, goal_value.value)
    )
    fields = relation.placed(request, goal_value, (*plain("at "), *other))
    return Derived(fill(template, introduced), fields, {"patterns": ["contextual logic"]})


def _neighbor(request: InstructionRequest) -> Derived:
    """Derive a placement: of two, the neighbor of the other one."""
    (goal_value,) = request.values_of("relation")
    rejected = _rejected(goal_value)
    template = request.sampler.pick("neighbor introduction", templates.NEIGHBOR_INTRODUCTIONS)
    context = fill(
        template, {"moment": antecedent(templates.MOMENTS[rejected], REFERENCE, rejected)}
    )
    outside = request.outside_phrase(goal_value.field)
    if outside is not None and not outside.before:
        raise NoCommandError  # there is no word for the target that this could replace
    words = _single(request, rejected)
    single = (
        antecedent(words, REFERENCE, rejected)
        if request.resolved
        else anaphor(words, "that", REFERENCE, rejected)
    )
    placement = (*plain("the target of "), *fill(templates.NEIGHBOR, {"single": single}))
    notes: dict[str, object] = {
        "patterns": ["sequential relation"],
        "relation": "neighbor",
        "reference": rejected,
    }
    return Derived(context, {goal_value.field: placement}, notes)


def _allows(request: InstructionRequest) -> bool:
    return bool(request.values_of("relation"))


OTHER = Pattern(_allows, _other)
NEIGHBOR = Pattern(_allows, _neighbor)
