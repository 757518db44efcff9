"""Color exclusion, and contextual logic on the two excluded colors."""

from __future__ import annotations

import itertools

from roboirg.language import templates
from roboirg.language.patterns.pattern import REFERENCE, Derived, Pattern
from roboirg.language.phrases import Phrase, anaphor, antecedent, fill, plain, sentences
from roboirg.language.request import GoalValue, InstructionRequest
from roboirg.language.slot_types import described


def _exclude(request: InstructionRequest) -> Derived:
    """Derive a color as the one outside a pair, and a second one as the other of the pair."""
    target, *rest = request.color_values
    others = request.other_colors(target.color)
    pair = request.sampler.pick("pair", list(itertools.permutations(others)))
    both = " and ".join(pair)
    named = antecedent(both, REFERENCE, both)
    template = request.sampler.pick("pair introduction", templates.PAIR_INTRODUCTIONS)
    context = [fill(template, {"pair": named})]
    counted = bool(request.values_of("amount"))
    anaphors = templates.AMOUNT_PAIR_ANAPHORS if counted else templates.PAIR_ANAPHORS
    word = request.sampler.pick("pair anaphor", anaphors)
    reference = named if request.resolved else anaphor(word, "pair", REFERENCE, both)
    options = templates.AMOUNT_EXCLUSIONS if counted else templates.EXCLUSIONS
    exclusion = request.sampler.pick("exclusion", options)
    things = [_thing(request, target, exclusion, {"pair": reference})]
    patterns = ["color exclusion"]
    for goal_value in rest:
        context.append(_singled(request, goal_value, pair))
        options = templates.AMOUNT_COMPLEMENTS if counted else templates.COMPLEMENTS
        complement = request.sampler.pick("complement", options)
        other = _other(request, goal_value, pair, word)
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
    remark = request.sampler.pick("singled introduction", templates.SINGLED_INTRODUCTIONS)
    return fill(remark, {"single": antecedent(chosen, REFERENCE, chosen)})


def _other(
    request: InstructionRequest, goal_value: GoalValue, pair: tuple[str, ...], word: str
) -> Phrase:
    """Return the command's words for the other color of the pair."""
    if request.resolved:
        words = f"the color of {' and '.join(pair)} that is not {_rejected(goal_value, pair)}"
        return antecedent(words, goal_value.slot, goal_value.value)
    words = f"the color of {word} that I did not choose"
    return anaphor(words, "other", goal_value.slot, goal_value.value)


def _rejected(goal_value: GoalValue, pair: tuple[str, ...]) -> str:
    return next(color for color in pair if color != goal_value.value)


def _allows_one(request: InstructionRequest) -> bool:
    # The pair of the first pick determines the second one too, whatever the main pattern.
    return bool(request.values_of("color")) or len(request.color_values) == 1


def _allows_two_amounts(request: InstructionRequest) -> bool:
    return bool(request.values_of("amount")) and len(request.color_values) == 2  # noqa: PLR2004


ONE_COLOR = Pattern(_allows_one, _exclude)
TWO_AMOUNTS = Pattern(_allows_two_amounts, _exclude)
