"""Patterns of the two moments around the button press: the other moment, or the neighbor."""

from __future__ import annotations

from roboirg.language.patterns.pattern import Derived, Pattern
from roboirg.language.phrases import MentionedValue, Phrase, antecedent, fill, plain
from roboirg.language.request import GoalValue, InstructionRequest
from roboirg.language.slot_types import relation
from roboirg.language.templates import derivations


def _rejected(goal_value: GoalValue) -> str:
    return next(one for one in derivations.MOMENTS if one != goal_value.value)


def _single(request: InstructionRequest, rejected: str) -> str:
    """Return the command's words for the moment or placement that is not meant."""
    return f"the one {derivations.MOMENTS[rejected]}" if request.resolved else "that one"


def _other(request: InstructionRequest) -> Derived:
    """Derive a moment: of the two, the one that was not chosen."""
    (goal_value,) = request.values_of("relation")
    rejected = _rejected(goal_value)
    template = request.pick("two moments", derivations.TWO_MOMENTS_INTRODUCTIONS)
    introduced: dict[str, Phrase] = {
        "pair": antecedent(
            derivations.BOTH_MOMENTS, MentionedValue(" and ".join(derivations.MOMENTS))
        ),
        "single": antecedent(f"the one right {rejected} it", MentionedValue(rejected)),
    }
    single = derivations.MOMENTS[rejected]
    named = derivations.RESOLVED_MOMENT_COMPLEMENT.format(single=single)
    other = request.refer(derivations.MOMENT_COMPLEMENT, "other", goal_value, resolved=named)
    fields = relation.placed(goal_value, other)
    return Derived(fill(template, introduced), fields, {"patterns": ["contextual logic"]})


def _neighbor(request: InstructionRequest) -> Derived:
    """Derive a placement: of two, the neighbor of the other one."""
    (goal_value,) = request.values_of("relation")
    rejected = _rejected(goal_value)
    template = request.pick("neighbor introduction", derivations.NEIGHBOR_INTRODUCTIONS)
    context = fill(
        template, {"moment": antecedent(derivations.MOMENTS[rejected], MentionedValue(rejected))}
    )
    words = _single(request, rejected)
    single = request.refer(words, "that", MentionedValue(rejected), resolved=words)
    placement = (*plain("the target of "), *fill(derivations.NEIGHBOR, {"single": single}))
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
