"""The spatial setting: the introduction names a place instead of a color; the command points there.

Counts stay explicit.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from roboirg.core.motions import Swap
from roboirg.language import templates
from roboirg.language.instruction import Expression
from roboirg.language.landmarks import FRAMES, Landmark, landmarks
from roboirg.language.phrases import Phrase, anaphor, antecedent, fill, listed, plain, sentences
from roboirg.language.request import (
    COLOR_SLOTS,
    GoalValue,
    InstructionRequest,
    InstructionSpec,
    UtteranceSpec,
)
from roboirg.language.setting import Setting
from roboirg.language.settings.explicit import stated
from roboirg.language.slot_types import described

POINTING: Mapping[int, tuple[tuple[str, Expression], ...]] = {
    1: (("there", "there"),),
    2: (("at the former place", "former"), ("at the latter place", "latter")),
    3: (
        ("at the first place", "first"),
        ("at the second place", "second"),
        ("at the third place", "third"),
    ),
}


def usable(request: InstructionRequest, goal_value: GoalValue) -> tuple[Landmark, ...]:
    """Return the landmarks of the best class that locate a thing of this color."""
    thing = request.task.commands.thing
    scene = request.episode.scene
    found = [
        landmark
        for target in request.targets(goal_value)
        for landmark in landmarks(scene, thing, target, request.frame)
    ]
    best = min((landmark.level for landmark in found), default=0)
    return tuple(landmark for landmark in found if landmark.level == best)


def refusal(request: InstructionRequest) -> str | None:
    """Return a reason if some color of the goal has no thing with a landmark."""
    if all(usable(request, goal_value) for goal_value in request.color_values):
        return None
    return "no landmark singles out a target"


def say(request: InstructionRequest) -> InstructionSpec:
    """Return an introduction with a landmark for each color, and a command that points there."""
    colors = request.color_values
    chosen = [
        request.sampler.pick(f"landmark-{color.field}", usable(request, color)) for color in colors
    ]
    things: list[Phrase] = []
    pointing = POINTING[len(colors)]
    for color, landmark, (words, expression) in zip(colors, chosen, pointing, strict=True):
        place = (
            antecedent(landmark.phrase, color.slot, color.value)
            if request.resolved
            else anaphor(words, expression, color.slot, color.value)
        )
        things.append(request.by_place(color, place, plural=request.count_of(color) > 1))
    fields = stated(request) | described(request, things)
    utterances = (
        introduction(request, colors, chosen),
        UtteranceSpec("command", request.command(fields)),
    )
    notes = {
        "landmarks": [landmark.phrase for landmark in chosen],
        "landmark_classes": [landmark.level for landmark in chosen],
        "frame": request.frame,
    }
    return InstructionSpec(utterances, notes)


def introduction(
    request: InstructionRequest, colors: Sequence[GoalValue], chosen: Sequence[Landmark]
) -> UtteranceSpec:
    """Name the places; say where needed whose left and right is meant, and at what time."""
    noun = plain(f"the {request.task.commands.thing} ")
    things: list[Phrase] = [
        (*noun, *antecedent(landmark.phrase, color.slot, color.value))
        for color, landmark in zip(colors, chosen, strict=True)
    ]
    if not any(landmark.sided for landmark in chosen):
        purpose, options = "place introduction", templates.PLACE_INTRODUCTIONS
    elif request.frame == "robot":
        purpose, options = "sided place introduction", templates.SIDED_PLACE_INTRODUCTIONS
    else:
        purpose, options = "camera place introduction", templates.CAMERA_PLACE_INTRODUCTIONS
    template = request.sampler.pick(purpose, options)
    remarks = [fill(template, {"things": listed(things)}, plural=len(things) > 1)]
    if any(isinstance(motion, Swap) for motion in request.episode.scene.motions):
        remarks.append(plain(request.sampler.pick("moved", templates.MOVED_INTRODUCTIONS)))
    return UtteranceSpec("introduction", sentences(remarks))


SETTING = Setting(
    name="spatial",
    order=4,
    summary="a place identifies the object; the command points there",
    color="#CC79A7",
    say=say,
    applies_to=lambda task: task.spatial,
    refusal=refusal,
    hidden_slots=lambda _instruction, goal: frozenset(goal.as_mapping()) & frozenset(COLOR_SLOTS),
    reads=frozenset({"frame", "delivery"}),
    variants=tuple({"frame": frame} for frame in FRAMES),
    hides_only_color=lambda _instruction: True,
    example=6,
)
