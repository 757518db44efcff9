"""Open contextual logic: of two moments, the favorite one or the other, named in either order."""

from __future__ import annotations

from roboirg.language.balanced_draw import draw_balanced
from roboirg.language.instruction import REFERENCE
from roboirg.language.open_reasoning import open_templates as templates
from roboirg.language.patterns.pattern import Derived, Pattern
from roboirg.language.phrases import anaphor, antecedent, fill, plain
from roboirg.language.request import InstructionRequest
from roboirg.language.slot_types import relation
from roboirg.language.templates.derivations import MOMENTS


def _derive(request: InstructionRequest) -> Derived:
    (goal_value,) = request.values_of("relation")
    other = next(one for one in MOMENTS if one != goal_value.value)
    favorite_first, goal_is_favorite = draw_balanced(request, "favorite moment")
    favorite, least = (
        (str(goal_value.value), other) if goal_is_favorite else (other, str(goal_value.value))
    )
    first, last = (favorite, least) if favorite_first else (least, favorite)
    words = {first: MOMENTS[first], last: f"right {last} it"}
    template = request.pick("preference", templates.PREFERENCES[0 if favorite_first else 1])
    slots = {str(goal_value.value): goal_value.slot, other: REFERENCE}
    named = {one: antecedent(words[one], slots[one], one) for one in (favorite, least)}
    who = plain(request.pick("who", templates.WHO))
    context = fill(template, {"who": who, "yes": named[favorite], "no": named[least]})
    pools = templates.FAVORITES if goal_is_favorite else templates.NOT_FAVORITES
    pointer = request.pick("favorite", pools)
    resolved = MOMENTS[favorite] if goal_is_favorite else f"that is not {MOMENTS[favorite]}"
    moment = (
        antecedent(f"at the moment {resolved}", goal_value.slot, goal_value.value)
        if request.resolved
        else anaphor(
            pointer, "choice" if goal_is_favorite else "other", goal_value.slot, goal_value.value
        )
    )
    notes: dict[str, object] = {
        "patterns": ["contextual logic"],
        "relation": "favorite" if goal_is_favorite else "not the favorite",
        "candidates": {goal_value.slot: list(MOMENTS)},
    }
    return Derived(context, relation.placed(request, goal_value, moment), notes)


FAVORITE = Pattern(lambda request: bool(request.values_of("relation")), _derive)
