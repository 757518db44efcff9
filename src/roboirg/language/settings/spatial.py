"""Spatial: the color is told by a place, which the introduction names and the command points at.

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


def usable(request: InstructionRequest, part: GoalValue) -> tuple[Landmark, ...]:
    """The landmarks of the best class that could tell where a thing of this part is."""
    thing = request.task.commands.thing
    scene = request.episode.scene
    found = [
        landmark
        for target in request.targets(part)
        for landmark in landmarks(scene, thing, target, request.frame)
    ]
    best = min((landmark.level for landmark in found), default=0)
    return tuple(landmark for landmark in found if landmark.level == best)


def refusal(request: InstructionRequest) -> str | None:
    """Say that no landmark tells a target apart, unless every color has a thing with one."""
    if all(usable(request, part) for part in request.colored):
        return None
    return "no landmark tells its target from the other objects"


def say(request: InstructionRequest) -> InstructionSpec:
    """An introduction with a landmark for each color, and a command that points there."""
    parts = request.colored
    chosen = [
        request.chooser.pick(f"landmark-{part.field}", usable(request, part)) for part in parts
    ]
    things: list[Phrase] = []
    pointing = POINTING[len(parts)]
    for part, landmark, (words, expression) in zip(parts, chosen, pointing, strict=True):
        place = (
            antecedent(landmark.phrase, part.slot, part.value)
            if request.resolved
            else anaphor(words, expression, part.slot, part.value)
        )
        things.append(request.by_place(place, plural=request.count_of(part) > 1))
    fields = stated(request) | described(request, things)
    said = (introduction(request, parts, chosen), UtteranceSpec("command", request.command(fields)))
    notes = {
        "landmarks": [landmark.phrase for landmark in chosen],
        "landmark_classes": [landmark.level for landmark in chosen],
        "frame": request.frame,
    }
    return InstructionSpec(said, notes)


def introduction(
    request: InstructionRequest, parts: Sequence[GoalValue], chosen: Sequence[Landmark]
) -> UtteranceSpec:
    """The places, whose left and right is meant where it matters, and when, if things move."""
    noun = plain(f"the {request.task.commands.thing} ")
    things: list[Phrase] = [
        (*noun, *antecedent(landmark.phrase, part.slot, part.value))
        for part, landmark in zip(parts, chosen, strict=True)
    ]
    if not any(landmark.sided for landmark in chosen):
        purpose, options = "place introduction", templates.PLACE_INTRODUCTIONS
    elif request.frame == "robot":
        purpose, options = "sided place introduction", templates.SIDED_PLACE_INTRODUCTIONS
    else:
        purpose, options = "camera place introduction", templates.CAMERA_PLACE_INTRODUCTIONS
    template = request.chooser.pick(purpose, options)
    said = [fill(template, {"things": listed(things)}, plural=len(things) > 1)]
    if any(isinstance(motion, Swap) for motion in request.episode.scene.motions):
        said.append(plain(request.chooser.pick("moved", templates.MOVED_INTRODUCTIONS)))
    return UtteranceSpec("introduction", sentences(said))


SETTING = Setting(
    name="spatial",
    order=4,
    summary="a place tells the thing; the command points there",
    color="#CC79A7",
    say=say,
    applies_to=lambda task: task.spatial,
    refusal=refusal,
    hidden_slots=lambda _instruction, goal: frozenset(goal.as_mapping()) & frozenset(COLOR_SLOTS),
    reads=frozenset({"frame"}),
    variants=tuple({"frame": frame} for frame in FRAMES),
    hides_only_color=lambda _instruction: True,
    example=6,
)
