"""Color exclusion, and contextual logic on the two excluded colors."""

from __future__ import annotations

import itertools

from roboirg.language.instruction import REFERENCE
from roboirg.language.patterns.pattern import Derived, Pattern
from roboirg.language.phrases import Phrase, anaphor, antecedent, fill, plain, sentences
from roboirg.language.request import GoalValue, InstructionRequest
from roboirg.language.slot_types import described
from roboirg.language.templates import derivations


def _exclude(request: InstructionRequest) -> Derived:
    """Derive a color as the one outside a pair, and a second one as the other of the pair."""
    target, *rest = request.color_values
    others = request.other_colors(target.color)
    pair = request.sampler.pick("pair", list(itertools.permutations(others)))
    both = " and ".join(pair)
    template = request.pick("pair introduction", derivations.PAIR_INTRODUCTIONS)
    context = [fill(template, {"pair": antecedent(both, REFERENCE, both)})]
    counted = bool(request.values_of("amount"))
    word = request.pick("pair anaphor", derivations.PAIR_ANAPHORS)
    reference = (
        antecedent(" nor ".join(pair), REFERENCE, both)
        if request.resolved
        else anaphor(word, "pair", REFERENCE, both)
    )
    exclusions = derivations.AMOUNT_EXCLUSIONS if counted else derivations.EXCLUSIONS
    exclusion = request.pick("exclusion", exclusions)
    things = [_thing(request, target, exclusion, {"pair": reference})]
    patterns = ["color exclusion"]
    for goal_value in rest:
        context.append(_singled(request, goal_value, pair))
        complement = derivations.AMOUNT_COMPLEMENT if counted else derivations.COMPLEMENT
        other = _other(request, goal_value, pair)
        things.append(_thing(request, goal_value, complement, {"other": other}))
        patterns.append("contextual logic")
    return Derived(sentences(context), described(request, things), {"patterns": patterns})


def _thing(
    request: InstructionRequest, goal_value: GoalValue, template: str, fields: dict[str, Phrase]
) -> Phrase:
    words = {"thing": plain(request.task.commands.colored), **fields}
    cubes = fill(template, words, plural=request.count_of(goal_value) > 1)
    return request.by_color(goal_value, cubes)


def _singled(request: InstructionRequest, goal_value: GoalValue, pair: tuple[str, ...]) -> Phrase:
    """Return a remark that chooses the color of the pair that is not meant."""
    chosen = _rejected(goal_value, pair)
    remark = request.pick("singled introduction", derivations.SINGLED_INTRODUCTIONS)
    return fill(remark, {"single": antecedent(chosen, REFERENCE, chosen)})


def _other(request: InstructionRequest, goal_value: GoalValue, pair: tuple[str, ...]) -> Phrase:
    """Return the command's words for the other color of the pair."""
    if request.resolved:
        words = f"{' or '.join(pair)}, not {_rejected(goal_value, pair)}"
        return antecedent(words, goal_value.slot, goal_value.value)
    return anaphor("the other of those colors", "other", goal_value.slot, goal_value.value)


def _rejected(goal_value: GoalValue, pair: tuple[str, ...]) -> str:
    return next(color for color in pair if color != goal_value.value)


def _allows_one(request: InstructionRequest) -> bool:
    # The pair of the first pick determines the second one too, whatever the main pattern.
    return bool(request.values_of("color")) or len(request.color_values) == 1


def _allows_two_amounts(request: InstructionRequest) -> bool:
    return bool(request.values_of("amount")) and len(request.color_values) == 2  # noqa: PLR2004


ONE_COLOR = Pattern(_allows_one, _exclude)
TWO_AMOUNTS = Pattern(_allows_two_amounts, _exclude)
