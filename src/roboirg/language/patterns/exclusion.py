"""Color exclusion, and contextual logic on the two excluded colors."""

from __future__ import annotations

import itertools

from roboirg.language import templates
from roboirg.language.patterns.pattern import REFERENCE, Derived, Pattern
from roboirg.language.phrases import Phrase, anaphor, antecedent, fill, plain, sentences
from roboirg.language.request import GoalValue, InstructionRequest
from roboirg.language.slot_types import described


def _exclude(request: InstructionRequest) -> Derived:
    """The color that is not among two; a second target is the other one of the two."""
    target, *rest = request.colored
    others = request.other_colors(target.color)
    pair = request.chooser.pick("pair", list(itertools.permutations(others)))
    both = " and ".join(pair)
    named = antecedent(both, REFERENCE, both)
    template = request.chooser.pick("pair introduction", templates.PAIR_INTRODUCTIONS)
    context = [fill(template, {"pair": named})]
    counted = bool(request.parts_of("amount"))
    anaphors = templates.AMOUNT_PAIR_ANAPHORS if counted else templates.PAIR_ANAPHORS
    word = request.chooser.pick("pair anaphor", anaphors)
    reference = named if request.resolved else anaphor(word, "pair", REFERENCE, both)
    options = templates.AMOUNT_EXCLUSIONS if counted else templates.EXCLUSIONS
    exclusion = request.chooser.pick("exclusion", options)
    things = [_thing(request, target, exclusion, {"pair": reference})]
    patterns = ["color exclusion"]
    for part in rest:
        context.append(_singled(request, part, pair))
        options = templates.AMOUNT_COMPLEMENTS if counted else templates.COMPLEMENTS
        complement = request.chooser.pick("complement", options)
        other = _other(request, part, pair, word)
        things.append(_thing(request, part, complement, {"other": other}))
        patterns.append("contextual logic")
    return Derived(sentences(context), described(request, things), {"patterns": patterns})


def _thing(
    request: InstructionRequest, part: GoalValue, template: str, fields: dict[str, Phrase]
) -> Phrase:
    words = {"thing": plain(request.task.commands.colored), **fields}
    return request.by_color(fill(template, words, plural=request.count_of(part) > 1))


def _singled(request: InstructionRequest, part: GoalValue, pair: tuple[str, ...]) -> Phrase:
    """A remark that chooses one of the pair, not the one that is meant."""
    chosen = _rejected(part, pair)
    remark = request.chooser.pick("singled introduction", templates.SINGLED_INTRODUCTIONS)
    return fill(remark, {"single": antecedent(chosen, REFERENCE, chosen)})


def _other(
    request: InstructionRequest, part: GoalValue, pair: tuple[str, ...], word: str
) -> Phrase:
    """The command's words for the other one of the pair."""
    if request.resolved:
        words = f"the color of {' and '.join(pair)} that is not {_rejected(part, pair)}"
        return antecedent(words, part.slot, part.value)
    words = f"the color of {word} that I did not choose"
    return anaphor(words, "other", part.slot, part.value)


def _rejected(part: GoalValue, pair: tuple[str, ...]) -> str:
    return next(color for color in pair if color != part.value)


def _allows_one(request: InstructionRequest) -> bool:
    # The second of two picks is told by the pair of the first, whatever the main pattern's name.
    return bool(request.parts_of("color")) or len(request.colored) == 1


def _allows_two_amounts(request: InstructionRequest) -> bool:
    return bool(request.parts_of("amount")) and len(request.colored) == 2  # noqa: PLR2004


ONE_COLOR = Pattern(_allows_one, _exclude)
TWO_AMOUNTS = Pattern(_allows_two_amounts, _exclude)
