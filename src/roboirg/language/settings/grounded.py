"""The grounded setting: the introduction describes what only the scene or the video shows.

The command points back at it. Slots for which there is nothing to see stay explicit; an episode
without any other slot is refused.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from roboirg.core.episode import Goal, values_in
from roboirg.core.goal_slots import COLOR_SLOTS
from roboirg.core.instruction_options import DEFAULT_LANGUAGE
from roboirg.language.grounded import (
    Clue,
    amount_clues,
    draw_clue,
    late,
    placement_clues,
    repeat_clues,
    spoken_clues,
    thing_clues,
)
from roboirg.language.grounded.grounded_templates import (
    COUNTED,
    PLACEMENT_INTRODUCTIONS,
)
from roboirg.language.phrases import (
    Phrase,
    anaphor,
    antecedent,
    fill,
    listed,
    plain,
    sentences,
    swap_particles,
)
from roboirg.language.request import GoalValue, InstructionRequest, InstructionSpec, UtteranceSpec
from roboirg.language.settings.setting import Setting
from roboirg.language.slot_types import Fields, amount, color, described, number, stated
from roboirg.language.templates import introductions
from roboirg.tasks import Task

MOST_COLORS = 2
"""Colors that the words describe; three would be too many words, and mostly all there are."""
Clues = Mapping[GoalValue, Clue]


def refusal(request: InstructionRequest) -> str | None:
    """Return why nothing in an episode can be described by what is seen; None if something can."""
    is_new = request.options.language != DEFAULT_LANGUAGE
    # Of amounts each language says what it can; the others refuse the same scenes in both.
    spoken = is_new and bool(request.values_of("amount"))
    if clues_of(request, spoken=spoken):
        return None
    return "nothing to see in this scene singles out a slot's value"


def say(request: InstructionRequest) -> InstructionSpec:
    """Return an introduction that describes what is seen, and a command that points back at it."""
    clues = clues_of(request)
    remarks: list[Phrase] = []
    fields = stated(request)
    colors: dict[GoalValue, Clue] = {}
    for value, clue in clues.items():
        if value.slot in COLOR_SLOTS:
            colors[value] = clue
        else:
            remark, field = _WORDS[value.slot](request, value, clue)
            remarks.append(remark)
            fields |= field
    if colors:
        remarks.append(_introduced(request, colors))
        fields |= described(request, _pointed(request, colors))
    kinds = [clue.kind for clue in clues.values()]
    notes: dict[str, object] = {
        "touched": list(dict.fromkeys(value.slot for value in clues)),
        "pattern": kinds[0],
        "patterns": list(dict.fromkeys(kinds)),
    }
    utterances = (
        UtteranceSpec("introduction", sentences(remarks)),
        UtteranceSpec("command", swap_particles(request.command(fields))),
    )
    return InstructionSpec(utterances, notes)


def clues_of(request: InstructionRequest, *, spoken: bool = False) -> Clues:
    """Return a clue for each value that the words leave to what is seen, in order of speaking.

    `spoken` takes the clues to things in the words of language 4.
    """
    found: dict[GoalValue, Clue] = {}
    for value in request.goal_values:
        clues = _clues_to(request, value, spoken=spoken)
        clue = draw_clue(request, f"{value.field} seen", clues)
        if clue is not None:
            found[value] = clue
    colors = request.color_values
    some_lack = any(one not in found for one in colors)
    if not spoken and (len(colors) > MOST_COLORS or some_lack):
        # The words describe all colors of the goal, or none; those of language 4 only one.
        found = {value: clue for value, clue in found.items() if value not in colors}
    if any(one.slot == "colors" for one in found):
        found = {value: clue for value, clue in found.items() if value.slot != "counts"}
    return found


def _is_open(request: InstructionRequest, slot: str) -> bool:
    """Return whether several goals of the scene agree in all other slots, in any order."""
    goal = _others(request.episode.goal, slot)
    goals = request.task.goals(request.episode.scene)
    return sum(_others(one, slot) == goal for one in goals) > 1


def _others(goal: Goal, slot: str) -> list[str]:
    return sorted(
        str(value) for name, content in goal.slots if name != slot for value in values_in(content)
    )


def _clues_to(request: InstructionRequest, value: GoalValue, *, spoken: bool) -> list[Clue]:
    """Return the clues to a value that the scene leaves open, in the words of a language."""
    if not _is_open(request, value.slot):
        return []
    if value.slot not in COLOR_SLOTS:
        clues_to = _SOUGHT.get(value.slot)
        return clues_to(request, value) if clues_to else []
    clues = _spoken_clues(request, value) if spoken else thing_clues(request, value)
    if len(request.color_values) == 1:
        return clues
    return [clue for clue in clues if clue.kind != "sets"]  # two in one sentence are too long


def _spoken_clues(request: InstructionRequest, color: GoalValue) -> list[Clue]:
    """Return the clues of language 4 to the things of a color."""
    if request.values_of("amount") and late(request.episode.scene):
        return []  # another cube may be meant when it is there
    targets = request.objects_to_point_at(color)
    known = spoken_clues(request.episode.scene, request.task)
    clues = [found.clue for found in known if found.thing in targets]
    if request.values_of("amount"):
        # Of several things of a color, one with simple words stands for all.
        clues = [clue for clue in clues if clue.kind != "bridging"] or clues
    return clues


_SOUGHT = {
    "repeats": repeat_clues,
    "placement": placement_clues,
    "relation": placement_clues,
    "counts": amount_clues,
}
"""The clues to a value that is no color, by slot.

Those to a visit are missing, because nothing can be counted.
"""


def _introduced(request: InstructionRequest, colors: Clues) -> Phrase:
    """Return a sentence that describes the things, or two about the only one."""
    (value, clue), *others = colors.items()
    if clue.said and not others:
        return fill(clue.said, {"which": antecedent(clue.short, value)})
    things = [antecedent(clue.words, value) for value, clue in colors.items()]
    template = request.pick("place introduction", introductions.PLACE_INTRODUCTIONS)
    return fill(template, {"things": listed(things)}, plural=len(things) > 1)


def _pointed(request: InstructionRequest, colors: Clues) -> list[Phrase]:
    """Return the command's words for the things to handle."""
    commands = request.task.commands
    pointers: Sequence[color.Pointer] = color.FORMER
    if len(colors) == 1:
        (clue,) = colors.values()
        noun = commands.thing if clue.of_handled else commands.pointed
        single = color.singles(noun.removeprefix("hidden_"))
        pointers = (request.sampler.pick("color anaphor", single),)
    things: list[Phrase] = []
    for (value, clue), pointer in zip(colors.items(), pointers, strict=True):
        place = request.refer(*pointer, value, resolved=clue.words)
        template = commands.by_rank or commands.by_color.replace("{cube}", "{place}")
        if clue.of_handled or (commands.pointed == commands.thing and commands.by_rank is None):
            template = "{place}"
        plural = request.count_of(value) > 1
        things.append(request.by_place(value, place, plural=plural, template=template))
    return things


def _repeats(request: InstructionRequest, value: GoalValue, clue: Clue) -> tuple[Phrase, Fields]:
    template = request.pick("number introduction", COUNTED)
    words = request.pick("same number", number.SAME_NUMBER)
    said = fill(template, {"times": antecedent(clue.short, value)})
    times = request.refer(words, "that", value, resolved=clue.words)
    return said, {value.field: times}


def _counts(request: InstructionRequest, value: GoalValue, clue: Clue) -> tuple[Phrase, Fields]:
    (shade,) = request.color_values
    cubes = (*plain(" of the "), *amount.cubes(shade, MOST_COLORS))
    said = (*antecedent(clue.words, value), *cubes)
    if clue.after:
        said = (*said, *plain(" "), *antecedent(clue.after, value))
    template = request.pick("amount introduction", introductions.AMOUNT_INTRODUCTIONS)
    pointing = (*anaphor("that many", "that", value), *cubes)
    command = amount.amounts([said if request.resolved else pointing])
    return fill(template, {"things": said}), command


def _placed(request: InstructionRequest, value: GoalValue, clue: Clue) -> tuple[Phrase, Fields]:
    said = antecedent(clue.words, value)
    template = request.pick("seen placement", PLACEMENT_INTRODUCTIONS)
    pointing = anaphor("that placement", "that", value)
    target = (*plain("the target of "), *(said if request.resolved else pointing))
    return fill(template, {"which": said}), {value.field: target}


_WORDS = {"repeats": _repeats, "counts": _counts, "placement": _placed, "relation": _placed}


def _applies_to(task: Task) -> bool:
    """Return whether a task has anything to look at: StopCube and the real tasks do not."""
    return task.suite != "real" and task.name != "StopCube"


SETTING = Setting(
    name="grounded",
    order=5,
    summary="the introduction describes what only the scene or the video shows",
    color="#44AA99",
    say=say,
    applies_to=_applies_to,
    refusal=refusal,
    reads=frozenset({"delivery", "language"}),
    example=2,
    plain="direct",
    offers="grounded",
)
