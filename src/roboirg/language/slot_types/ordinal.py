"""Ordinals: the number of a visit of the moving cube, or of a placement in the video."""

from __future__ import annotations

from typing import Literal

from roboirg.core.motions import Shuttle
from roboirg.core.word_pools import Pools
from roboirg.language.instruction import REFERENCE
from roboirg.language.number_words import ordinal
from roboirg.language.phrases import MentionedValue, Phrase, anaphor, antecedent, fill
from roboirg.language.request import GoalValue, GoalValues, InstructionRequest
from roboirg.language.slot_types.slot_type import Fields, SlotType, competing_with, pointing_at
from roboirg.language.templates import introductions, remarks

INTRODUCTIONS = {
    "visit": introductions.VISIT_INTRODUCTIONS,
    "placement": introductions.PLACEMENT_INTRODUCTIONS,
}
REFERENCE_INTRODUCTIONS = {
    "visit": introductions.REFERENCE_VISIT_INTRODUCTIONS,
    "placement": introductions.REFERENCE_PLACEMENT_INTRODUCTIONS,
}
WRAPPED = {"visit": "during {which}", "placement": "the target of {which}"}
"""The command's field around the words for the element of the series."""
OWNERS = {"visit": "its", "placement": "the"}
"""The determiner; *its placement* would give the cube away, as only one was placed."""
INTRODUCED_OWNERS = {"visit": "the cube's", "placement": "the"}
"""The same before anything is named."""
MOST = {"visit": 5, "placement": 4}
"""The last position that a competing remark may name."""


def series_length(request: InstructionRequest, goal_value: GoalValue) -> int:
    """Return the length of the episode's series: visits to come, or placements shown."""
    scene = request.episode.scene
    if goal_value.slot_type == "visit":
        return sum(shuttle.passes for shuttle in scene.motions_of(Shuttle))
    targets = {target.name for target in scene.of_kind("target")}
    return sum(fact.kind == "placed" and fact.place in targets for fact in scene.past)


def wrapped(goal_value: GoalValue, which: Phrase) -> Fields:
    """Return the command's field, given the words for the visit or placement."""
    return {goal_value.field: fill(WRAPPED[goal_value.slot_type], {"which": which})}


def _stated(_request: InstructionRequest, goal_values: GoalValues) -> Fields:
    """Return ``during its third visit``, ``the target of the second placement``."""
    (goal_value,) = goal_values
    words = f"{OWNERS[goal_value.slot_type]} {ordinal(goal_value.number)} {goal_value.slot_type}"
    return wrapped(goal_value, antecedent(words, goal_value))


def _reduced(_request: InstructionRequest, goal_values: GoalValues) -> Fields:
    """Return ``that visit``."""
    (goal_value,) = goal_values
    return wrapped(goal_value, anaphor(f"that {goal_value.slot_type}", "that", goal_value))


def _introduce(request: InstructionRequest, goal_values: GoalValues) -> Phrase:
    return introduce_position(request, goal_values[0], goal_values[0].slot, goal_values[0].number)


def introduce_position(
    request: InstructionRequest, goal_value: GoalValue, slot: str, position: int
) -> Phrase:
    """Return a sentence that names an element of the series."""
    known = REFERENCE_INTRODUCTIONS if slot == REFERENCE else INTRODUCTIONS
    template = request.pick(f"{goal_value.slot_type} introduction", known[goal_value.slot_type])
    words = f"{INTRODUCED_OWNERS[goal_value.slot_type]} {ordinal(position)} {goal_value.slot_type}"
    which = antecedent(words, MentionedValue(position, slot))
    return fill(template, {"which": which})


def _element(
    name: Literal["visit", "placement"], reinforcements: Pools[str], distractors: Pools[str]
) -> SlotType:
    return SlotType(
        name=name,
        stated=_stated,
        reduced=_reduced,
        introduce=_introduce,
        pointing=pointing_at(name),
        reinforcements=reinforcements,
        competing=competing_with(
            distractors, {one: ordinal(one) for one in range(1, MOST[name] + 1)}
        ),
    )


VISIT = _element("visit", remarks.VISIT_REINFORCEMENTS, remarks.COMPETING_VISIT_DISTRACTORS)
PLACEMENT = _element(
    "placement", remarks.VIDEO_REINFORCEMENTS, remarks.COMPETING_PLACEMENT_DISTRACTORS
)
