"""Spatial with a rival: two places are named alike, and the words before the command choose."""

from __future__ import annotations

import re
from collections.abc import Mapping

from roboirg.language.landmarks import Landmark
from roboirg.language.phrases import sentences
from roboirg.language.request import GoalValue, InstructionRequest, InstructionSpec, UtteranceSpec
from roboirg.language.rivals import draw_pair, pair_notes, pair_refusal
from roboirg.language.rivals.pair_words import choosing_remark, chosen, the_other
from roboirg.language.rivals.rival_templates import PLACE_PAIRS, RANKS
from roboirg.language.settings import spatial
from roboirg.language.settings.setting import Setting
from roboirg.language.slot_types import described, stated

_ORDINAL = re.compile(r"\b(?:second|third|fourth)\b")
PLACES = 2
"""Places that the introduction names: the meant one and its rival."""


def _usable(request: InstructionRequest, value: GoalValue) -> Mapping[int, list[Landmark]]:
    return spatial.usable(request, value, max(len(request.color_values), PLACES))


def refusal(request: InstructionRequest) -> str | None:
    """Return why an episode can have no rival at a place; None if it can."""
    if all(_usable(request, goal_value) for goal_value in request.color_values):
        return pair_refusal(request, _usable)
    return spatial.NO_LANDMARK


def say(request: InstructionRequest) -> InstructionSpec:
    """Return an introduction with two places, the remark that chooses one, and the command."""
    draw = draw_pair(request, _usable)
    meant, rival = draw.pair
    places = {value.field: _drawn(request, value) for value in draw.pair}
    if any(_ORDINAL.search(place.phrase) for place in places.values()):
        draw = draw._replace(pointers=RANKS)  # not "the second one" after "second from your left"
    thing = request.task.commands.pointed.removeprefix("hidden_")
    remark = choosing_remark(
        request, draw, lambda value: f"the {thing} {places[value.field].phrase}", thing
    )
    noun = "one" if request.values_of("amount") else thing
    pointing = [(meant, chosen(request, draw, f"the {noun}"))]
    if draw.pair.ordered:
        pointing.append((rival, the_other(rival, f"the other {noun}")))
    things = [
        spatial.at_place(request, value, places[value.field], words) for value, words in pointing
    ]
    command = request.command(stated(request) | described(request, things))
    shown = [places[value.field] for value in draw.introduced]
    utterances = (
        spatial.introduction(request, draw.introduced, shown, PLACE_PAIRS),
        UtteranceSpec("command", sentences([remark, command])),
    )
    notes = {**spatial.landmark_notes(request, shown), **pair_notes(draw)}
    return InstructionSpec(utterances, notes)


def _drawn(request: InstructionRequest, value: GoalValue) -> Landmark:
    return spatial.draw_landmark(request, value, _usable(request, value))


SETTING = Setting(
    name="spatial-rival",
    order=spatial.SETTING.order,
    summary="spatial, with a second place of the same kind; the last words single one out",
    color="#882255",
    say=say,
    applies_to=spatial.SETTING.applies_to,
    refusal=refusal,
    reads=spatial.SETTING.reads,
    variants=spatial.SETTING.variants,
    example=6,
    plain=spatial.SETTING.name,
)
