"""The spatial setting: the introduction names a place instead of a color; the command points there.

Counts stay explicit.
"""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence

from roboirg.language.instruction import Expression
from roboirg.language.landmarks import FRAMES, SIMPLE, Landmark, landmarks
from roboirg.language.number_words import plural
from roboirg.language.phrases import Phrase, anaphor, antecedent, fill, listed
from roboirg.language.request import GoalValue, InstructionRequest, InstructionSpec, UtteranceSpec
from roboirg.language.settings.setting import Setting
from roboirg.language.slot_types import described, stated
from roboirg.language.templates import introductions

Pointer = tuple[str, Expression]
POINTING: Mapping[int, tuple[Pointer, ...]] = {
    1: (("there", "there"),),
    2: (("the former", "former"), ("the latter", "latter")),
    3: (("the first", "first"), ("the second", "second"), ("the third", "third")),
}
_STANDS_LAST = re.compile(r"(?P<before>.*)the (?P<noun>\w+) \{place\}")
"""Words for a thing at a place, with nothing in between or after it."""
PAIR = 2
_NOUN = re.compile(r"^the \w+")
_TIME = re.compile(r" now\b")
"""Said of the first of two things, it goes for both."""
LONGEST = {1: 12, 2: 6, 3: 5}
"""The length that a landmark should have next to others, in `_length`; see `templates`."""


def _usable(
    request: InstructionRequest, goal_value: GoalValue, places: int
) -> Mapping[int, list[Landmark]]:
    """Return the landmarks that may locate a thing of this color, by class.

    These are the short ones of simple classes; or if there are none, the shortest one of a simple
    class, or of any other class. The introduction names this number of places.
    """
    found = [
        landmark
        for target in request.objects_to_point_at(goal_value)
        for landmark in landmarks(
            request.episode.scene, request.task.commands.pointed, target, request.frame
        )
    ]
    simple = [one for one in found if one.level <= SIMPLE]
    limit = LONGEST[places]
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
    places = len(request.color_values)
    if all(_usable(request, goal_value, places) for goal_value in request.color_values):
        return None
    return "no landmark singles out a target"


def say(request: InstructionRequest) -> InstructionSpec:
    """Return an introduction with a landmark for each color, and a command that points there."""
    colors, marks = request.color_values, draw_landmarks(request)
    things = [
        _pointed(request, color, landmark, pointer)
        for color, landmark, pointer in zip(colors, marks, POINTING[len(colors)], strict=True)
    ]
    fields = stated(request) | described(request, things)
    utterances = (
        _introduction(request, colors, marks),
        UtteranceSpec("command", request.command(fields)),
    )
    notes: dict[str, object] = {
        "landmarks": [landmark.phrase for landmark in marks],
        "landmark_classes": [landmark.level for landmark in marks],
        "frame": request.frame,
    }
    return InstructionSpec(utterances, notes)


def draw_landmarks(request: InstructionRequest) -> list[Landmark]:
    """Draw a landmark for each color, its class first, or most landmarks would be extremes."""
    found: list[Landmark] = []
    for color in request.color_values:
        classes = _usable(request, color, len(request.color_values))
        level = request.sampler.pick(f"landmark class-{color.field}", list(classes))
        found.append(request.sampler.pick(f"landmark-{color.field}", classes[level]))
    return found


def _pointed(
    request: InstructionRequest, color: GoalValue, landmark: Landmark, pointer: Pointer
) -> Phrase:
    """Return the command's words for a thing, which name its place or point at it."""
    words, expression = pointer
    if expression != "there":
        return _at_place(request, color, landmark, anaphor(words, expression, color))
    place = request.refer(words, expression, color, resolved=landmark.phrase)
    template = None
    stands_last = _STANDS_LAST.fullmatch(request.task.commands.by_place)
    if stands_last:
        # "That one over there": the noun is that of the introduction.
        noun = stands_last["noun"]
        words = request.sampler.pick(
            "noun there",
            (f"the {noun}", "that one", f"that {noun} over", "the one over"),
        )
        named = f"the {noun} {landmark.phrase}"
        place = request.refer(f"{words} there", expression, color, resolved=named)
        template = stands_last["before"] + "{place}"
    return request.by_place(color, place, plural=request.count_of(color) > 1, template=template)


def _at_place(
    request: InstructionRequest, value: GoalValue, landmark: Landmark, words: Phrase
) -> Phrase:
    """Return the command's words for one of several things; resolved, they name its place."""
    commands = request.task.commands
    if commands.by_rank is not None:
        named, template = f"the one {landmark.phrase}", commands.by_rank
    else:
        first = value == request.color_values[0]
        named = commands.things_at if first else _TIME.sub("", commands.things_at)
        named = named.format(place=landmark.phrase)
        handled = commands.pointed == commands.thing
        template = "{place}" if handled else commands.by_color.replace("{cube}", "{place}")
    place = antecedent(named, value) if request.resolved else words
    return request.by_place(value, place, plural=request.count_of(value) > 1, template=template)


def _introduction(
    request: InstructionRequest, colors: Sequence[GoalValue], marks: Sequence[Landmark]
) -> UtteranceSpec:
    """Name the places."""
    first = request.task.commands.things_at
    rest = _TIME.sub("", _NOUN.sub("the one", first))
    if len(marks) > PAIR:  # short: "the cubes closest to you, farthest to your left and ..."
        first, rest = _NOUN.sub(lambda noun: plural(noun[0]), first), "{place}"
    things = [
        fill(template, {"place": antecedent(landmark.phrase, color)})
        for template, color, landmark in zip((first, rest, rest), colors, marks, strict=False)
    ]
    sentence = request.pick("place introduction", introductions.PLACE_INTRODUCTIONS)
    words = fill(sentence, {"things": listed(things)}, plural=len(marks) > 1)
    return UtteranceSpec("introduction", words)


SETTING = Setting(
    name="spatial",
    order=4,
    summary="a place identifies the object; the command points there",
    color="#CC79A7",
    say=say,
    applies_to=lambda task: task.spatial,
    refusal=refusal,
    reads=frozenset({"frame", "delivery", "language"}),
    variants=tuple({"frame": frame} for frame in FRAMES),
    example=6,
    offers="spatial",
)
