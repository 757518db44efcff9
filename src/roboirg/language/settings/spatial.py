"""The spatial setting: the introduction names a place instead of a color; the command points there.

Counts stay explicit.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from roboirg.language.instruction import Expression
from roboirg.language.landmarks import FRAMES, SIMPLE, Landmark, landmarks
from roboirg.language.phrases import Phrase, anaphor, antecedent, fill, listed
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
from roboirg.language.templates import introductions

Pointer = tuple[str, Expression]
POINTING: Mapping[int, tuple[Pointer, ...]] = {
    1: (("there", "there"),),
    2: (("the former", "former"), ("the latter", "latter")),
    3: (("the first", "first"), ("the second", "second"), ("the third", "third")),
}
LONGEST = {1: 12, 2: 6, 3: 5}
"""The length that a landmark should have beside others, in `_length`; see `templates`."""


def usable(request: InstructionRequest, goal_value: GoalValue) -> Mapping[int, list[Landmark]]:
    """Return the landmarks that may locate a thing of this color, by class.

    These are the short ones of simple classes; or if there are none, the shortest one of a simple
    class, or of any other class.
    """
    found = [
        landmark
        for target in request.pointed(goal_value)
        for landmark in landmarks(
            request.episode.scene, request.task.commands.pointed, target, request.frame
        )
    ]
    simple = [one for one in found if one.level <= SIMPLE]
    limit = LONGEST[len(request.color_values)]
    short = [one for one in simple if _length(one) <= limit]
    possible = short or sorted(simple or found, key=_length)[:1]
    levels = sorted({one.level for one in possible})
    return {level: [one for one in possible if one.level == level] for level in levels}


def _length(landmark: Landmark) -> int:
    """Return the number of words, and of those that most tokenizers split once more."""
    words = landmark.phrase.split()
    return len(words) + 2 * words.count("farthest") + words.count("cube")


def refusal(request: InstructionRequest) -> str | None:
    """Return a reason if some color of the goal has no thing with a landmark."""
    if all(usable(request, goal_value) for goal_value in request.color_values):
        return None
    return "no landmark singles out a target"


def say(request: InstructionRequest) -> InstructionSpec:
    """Return an introduction with a landmark for each color, and a command that points there."""
    colors = request.color_values
    chosen = [_drawn(request, color) for color in colors]
    things = [
        _pointed(request, color, landmark, pointer)
        for color, landmark, pointer in zip(colors, chosen, POINTING[len(colors)], strict=True)
    ]
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


def _drawn(request: InstructionRequest, color: GoalValue) -> Landmark:
    """Draw the class first, or most landmarks would be extremes."""
    classes = usable(request, color)
    level = request.sampler.pick(f"landmark class-{color.field}", list(classes))
    return request.sampler.pick(f"landmark-{color.field}", classes[level])


def _pointed(
    request: InstructionRequest, color: GoalValue, landmark: Landmark, pointer: Pointer
) -> Phrase:
    """Return the command's words for a thing, which name its place or point at it."""
    words, expression = pointer
    several = expression != "there"
    ranked = several and request.task.commands.by_rank is not None
    if request.resolved:
        named = f"the one {landmark.phrase}" if ranked else landmark.phrase
        place = antecedent(named, color.slot, color.value)
    else:
        words = f"at {words} place" if several and not ranked else words
        place = anaphor(words, expression, color.slot, color.value)
    return request.by_place(color, place, plural=request.count_of(color) > 1, ranked=ranked)


def introduction(
    request: InstructionRequest, colors: Sequence[GoalValue], chosen: Sequence[Landmark]
) -> UtteranceSpec:
    """Name the places."""
    several = len(chosen) > 1
    places = listed(
        [
            antecedent(landmark.phrase, color.slot, color.value)
            for color, landmark in zip(colors, chosen, strict=True)
        ]
    )
    things = fill(request.task.commands.things_at, {"place": places}, plural=several)
    template = request.pick("place introduction", introductions.PLACE_INTRODUCTIONS)
    return UtteranceSpec("introduction", fill(template, {"things": things}, plural=several))


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
