"""Color exclusion: as few colors are named as leave exactly one in the scene.

Two are where three are there, one where two are. In a scene of a single color, one is named that
nothing there has.
"""

from __future__ import annotations

import itertools

from roboirg.language.patterns.pattern import Derived, Pattern
from roboirg.language.phrases import MentionedValue, Phrase, antecedent, fill, plain, sentences
from roboirg.language.request import GoalValue, InstructionRequest
from roboirg.language.slot_types import described
from roboirg.language.templates import derivations


def excluded_colors(request: InstructionRequest) -> tuple[str, ...]:
    """Return the colors to exclude; the first color of the goal is left."""
    target = request.color_values[0].color
    others = [color for color in request.scene_colors if color != target]
    if not others:
        return (request.sampler.pick("absent color", request.other_colors(target)),)
    return request.sampler.pick("excluded colors", list(itertools.permutations(others)))


def _exclude(request: InstructionRequest) -> Derived:
    """Derive a color as the one that is left, and a second one as the other of two excluded."""
    target, *rest = request.color_values
    colors = excluded_colors(request)
    context = [_introduction(request, colors, shared=bool(rest))]
    things = [_excluding(request, target, colors)]
    patterns = ["color exclusion"]
    counted = bool(request.values_of("amount"))
    for goal_value in rest:
        context.append(_singled(request, goal_value, colors))
        complement = derivations.AMOUNT_COMPLEMENT if counted else derivations.COMPLEMENT
        other = _other(request, goal_value, colors)
        things.append(_thing(request, goal_value, complement, {"other": other}))
        patterns.append("contextual logic")
    return Derived(sentences(context), described(request, things), {"patterns": patterns})


def _introduction(request: InstructionRequest, colors: tuple[str, ...], *, shared: bool) -> Phrase:
    known = derivations.SHARED_INTRODUCTIONS if shared else derivations.EXCLUDED_INTRODUCTIONS
    template = request.pick("pair introduction", known)
    words = " and ".join(colors)
    return fill(
        template, {"colors": antecedent(words, MentionedValue(words))}, plural=len(colors) > 1
    )


def _excluding(request: InstructionRequest, target: GoalValue, colors: tuple[str, ...]) -> Phrase:
    """Return ``the cube that is neither of those``, ``two cubes of a color other than that``."""
    options = derivations.EXCLUSIONS if len(colors) > 1 else derivations.SINGLE_EXCLUSIONS
    frame, words, resolved = request.pick("exclusion", options)
    excluded = request.refer(
        words,
        "pair" if len(colors) > 1 else "that",
        MentionedValue(" and ".join(colors)),
        resolved=resolved.format(colors=" nor ".join(colors)),
    )
    article = "" if request.values_of("amount") else "the "
    return _thing(request, target, f"{article}{frame}", {"excluded": excluded})


def _thing(
    request: InstructionRequest, goal_value: GoalValue, template: str, fields: dict[str, Phrase]
) -> Phrase:
    words = {"thing": plain(request.task.commands.colored), **fields}
    cubes = fill(template, words, plural=request.count_of(goal_value) > 1)
    return request.by_color(cubes)


def _singled(request: InstructionRequest, goal_value: GoalValue, pair: tuple[str, ...]) -> Phrase:
    """Return a remark that chooses the color of the pair that is not meant."""
    chosen = _rejected(goal_value, pair)
    remark = request.pick("singled introduction", derivations.SINGLED_INTRODUCTIONS)
    return fill(remark, {"single": antecedent(chosen, MentionedValue(chosen))})


def _other(request: InstructionRequest, goal_value: GoalValue, pair: tuple[str, ...]) -> Phrase:
    """Return the command's words for the other color of the pair."""
    named = f"{' or '.join(pair)}, not {_rejected(goal_value, pair)}"
    return request.refer("the other color", "other", goal_value, resolved=named)


def _rejected(goal_value: GoalValue, pair: tuple[str, ...]) -> str:
    return next(color for color in pair if color != goal_value.value)


def _allows(request: InstructionRequest) -> bool:
    colors = len(request.color_values)
    # A second pick is the other one of two excluded colors, so both of them must be there.
    return colors == 1 or (colors == 2 and len(request.scene_colors) == 3)  # noqa: PLR2004


COLOR_LEFT = Pattern(lambda request: _allows(request) and not _two_amounts(request), _exclude)
"""The first color of the goal is the one that is left."""


def _two_amounts(request: InstructionRequest) -> bool:
    return bool(request.values_of("amount")) and len(request.color_values) > 1


TWO_AMOUNTS = Pattern(lambda request: _allows(request) and _two_amounts(request), _exclude)
"""The same, and then the other of the two excluded ones."""
