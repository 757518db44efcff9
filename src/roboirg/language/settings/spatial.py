"""The spatial setting: the introduction names a place instead of a color; the command points there.

Counts stay explicit.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

from roboirg.core.episode import Goal
from roboirg.core.instruction_options import RIVALS
from roboirg.core.motions import Swap
from roboirg.language import templates
from roboirg.language.instruction import Expression, Instruction
from roboirg.language.landmarks import FRAMES, Landmark, landmarks
from roboirg.language.pairs import draw_pair, hidden_by_pair, pair_notes, pair_refusal, wants_pair
from roboirg.language.pairs.pair_words import choosing_remark, chosen, the_other
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
        return pair_refusal(request, usable)
    return "no landmark singles out a target"


def say(request: InstructionRequest) -> InstructionSpec:
    """Return an introduction with a landmark for each color, and a command that points there."""
    if wants_pair(request):
        return _say_with_rival(request)
    colors = request.color_values
    marks = [
        request.sampler.pick(f"landmark-{color.field}", usable(request, color)) for color in colors
    ]
    things: list[Phrase] = []
    pointing = POINTING[len(colors)]
    for color, landmark, (words, expression) in zip(colors, marks, pointing, strict=True):
        place = (
            antecedent(landmark.phrase, color.slot, color.value)
            if request.resolved
            else anaphor(words, expression, color.slot, color.value)
        )
        things.append(request.by_place(color, place, plural=request.count_of(color) > 1))
    fields = stated(request) | described(request, things)
    utterances = (
        introduction(request, colors, marks),
        UtteranceSpec("command", request.command(fields)),
    )
    return InstructionSpec(utterances, _notes(request, marks))


def _say_with_rival(request: InstructionRequest) -> InstructionSpec:
    """Return an introduction with two places, the remark that chooses one, and the command."""
    draw = draw_pair(request, usable)
    meant, rival = draw.pair
    places = {
        value.field: request.sampler.pick(f"landmark-{value.field}", usable(request, value))
        for value in draw.pair
    }
    thing = request.task.commands.thing
    remark = choosing_remark(
        request, draw, lambda value: f"the {thing} {places[value.field].phrase}", thing
    )
    counted = bool(request.values_of("amount"))
    noun = "one" if counted else thing
    pointing = [(meant, chosen(request, draw, f"the {noun}"))]
    if draw.pair.ordered:
        pointing.append((rival, the_other(rival, f"the other {noun}")))
    things: list[Phrase] = []
    for value, words in pointing:
        place = places[value.field].phrase
        full = "the one {place}" if counted else request.task.commands.by_place
        name = antecedent(full.format(place=place), value.slot, value.value)
        thing_words = name if request.resolved else words
        plural = request.count_of(value) > 1
        things.append(_whole(request).by_place(value, thing_words, plural=plural))
    command = request.command(stated(request) | described(request, things))
    shown = [places[value.field] for value in draw.introduced]
    utterances = (
        introduction(request, draw.introduced, shown),
        UtteranceSpec("command", sentences([remark, command])),
    )
    return InstructionSpec(utterances, {**_notes(request, shown), **pair_notes(draw)})


def _whole(request: InstructionRequest) -> InstructionRequest:
    """Return a request whose words for a place are those for the whole thing there."""
    commands = request.task.commands
    before, one, _ = commands.by_place.partition("the one {place}")
    by_place = f"{before}{{place}}" if one else "{place}"
    return replace(
        request, task=replace(request.task, commands=replace(commands, by_place=by_place))
    )


def _notes(request: InstructionRequest, landmarks: Sequence[Landmark]) -> dict[str, object]:
    return {
        "landmarks": [landmark.phrase for landmark in landmarks],
        "landmark_classes": [landmark.level for landmark in landmarks],
        "frame": request.frame,
    }


def introduction(
    request: InstructionRequest, colors: Sequence[GoalValue], marks: Sequence[Landmark]
) -> UtteranceSpec:
    """Name the places; say where needed whose left and right is meant, and at what time."""
    noun = plain(f"the {request.task.commands.thing} ")
    things: list[Phrase] = [
        (*noun, *antecedent(landmark.phrase, color.slot, color.value))
        for color, landmark in zip(colors, marks, strict=True)
    ]
    if not any(landmark.sided for landmark in marks):
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


def _hidden_slots(instruction: Instruction, goal: Goal) -> frozenset[str]:
    colors = frozenset(goal.as_mapping()) & frozenset(COLOR_SLOTS)
    return hidden_by_pair(instruction) or colors


SETTING = Setting(
    name="spatial",
    order=4,
    summary="a place identifies the object; the command points there",
    color="#CC79A7",
    say=say,
    applies_to=lambda task: task.spatial,
    refusal=refusal,
    hidden_slots=_hidden_slots,
    reads=frozenset({"frame", "delivery", "rival"}),
    variants=(
        *({"frame": frame} for frame in FRAMES),
        *({"frame": frame, "rival": RIVALS[-1]} for frame in FRAMES),
    ),
    hides_only_color=lambda _instruction: True,
    example=6,
)
