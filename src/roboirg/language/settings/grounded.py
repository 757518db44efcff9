"""The grounded setting: the introduction describes what only the scene or the video shows.

The command points back at it. Slots for which there is nothing to see stay explicit; an episode
without any other slot is refused.
"""

from __future__ import annotations

from collections.abc import Mapping

from roboirg.core.episode import Goal, Scene, values_in
from roboirg.core.goal_slots import COLOR_SLOTS
from roboirg.core.motions import Away
from roboirg.language.clues import CUBES_LEFT_OVER, Clue, EventClue, event_clues, thing_clues
from roboirg.language.request import GoalValue, InstructionRequest
from roboirg.language.settings.setting import Setting
from roboirg.tasks import Task

Clues = Mapping[GoalValue, Clue]


def refusal(request: InstructionRequest) -> str | None:
    """Return why nothing in an episode can be described by what is seen; None if something can.

    The text is the end of a sentence, without a stop.
    """
    if draw_clues(request):
        return None
    return "nothing to see in this scene singles out a slot's value"


def draw_clues(request: InstructionRequest) -> Clues:
    """Return words for what is to be seen for each value of the goal that has any; they are drawn.

    For the goal *red* it may be *the cube in the middle*. Where a color is described, counts are
    stated, so they have none.
    """
    clue_by_value = {}
    for value in request.goal_values:
        clues = _clues_to(request, value)
        if clues:
            clue_by_value[value] = _draw_clue(request, f"{value.field} seen", clues)
    has_color = any(value.slot == "colors" for value in clue_by_value)
    if has_color:  # the words then state the counts
        return {value: clue for value, clue in clue_by_value.items() if value.slot != "counts"}
    return clue_by_value


def _draw_clue(request: InstructionRequest, purpose: str, clues: list[Clue]) -> Clue:
    """Draw one of some clues, words for what is seen: first their kind, then one of this kind.

    Otherwise most clues would be of the most frequent kind.

    Args:
        request: the episode.
        purpose: of the draw; a hash key, so it has to stay.
        clues: at least one.
    """
    kinds = list(dict.fromkeys(clue.kind for clue in clues))
    kind = request.sampler.pick(f"{purpose} clue", kinds)
    return request.sampler.pick(purpose, [clue for clue in clues if clue.kind == kind])


def _clues_to(request: InstructionRequest, value: GoalValue) -> list[Clue]:
    """Return the words for what is to be seen that lead to a value of the goal.

    They speak of the video if there is one, and else of the scene. Empty if the other slots of the
    goal already give the value.
    """
    scene = request.episode.scene
    if not _is_open(request, value.slot):
        return []
    if scene.past:
        events = event_clues(scene)
        return [event.clue for event in events if _is_said(request, event, value)]
    if value.slot == "counts":
        return _amount_clues(request, value)
    if value.slot in COLOR_SLOTS:
        return _color_clues(request, value)
    return []


def _color_clues(request: InstructionRequest, color: GoalValue) -> list[Clue]:
    """Return words that lead to the things of a color, each by where it stands.

    Empty for amounts in scenes in which cubes arrive later.
    """
    scene = request.episode.scene
    if request.values_of("amount") and _is_late(scene):
        return []  # another cube may be meant when it is there
    targets = request.objects_to_point_at(color)
    clues = [found.clue for found in thing_clues(scene, request.task) if found.thing in targets]
    if len(request.color_values) > 1:
        # Two that set others aside are too long for a sentence.
        clues = [clue for clue in clues if clue.kind != "sets"]
    return clues


def _is_open(request: InstructionRequest, slot: str) -> bool:
    """Return whether the scene has goals that differ from the episode's in this slot only.

    If not, the values of the other slots give this one away.
    """
    other_values = _values_of_others(request.episode.goal, slot)
    goals = request.task.goals(request.episode.scene)
    equal_elsewhere = [goal for goal in goals if _values_of_others(goal, slot) == other_values]
    return len(equal_elsewhere) > 1


def _values_of_others(goal: Goal, slot: str) -> list[str]:
    """Return the values of all slots of a goal but one, as sorted texts, to compare goals."""
    values: list[str] = []
    for name, content in goal.slots:
        if name != slot:
            values += map(str, values_in(content))
    return sorted(values)


def _is_said(request: InstructionRequest, event: EventClue, value: GoalValue) -> bool:
    """Return whether a clue from the video leads to a value, and is drawn to be said.

    Some clues are said in a share of their scenes only, so that all values are equally frequent.
    """
    if event.slot != value.slot or event.value != value.value:
        return False
    if event.share is None:
        return True
    said, scenes = event.share  # (1, 3): in one of three scenes
    return request.sampler.pick("kept swaps", range(scenes)) < said


def _is_late(scene: Scene) -> bool:
    """Return whether some cubes of a scene arrive after its start."""
    return any(motion.under is None for motion in scene.motions_of(Away))


def _amount_clues(request: InstructionRequest, count: GoalValue) -> list[Clue]:
    """Return the clue *all but three* if it gives the number of cubes; else no clue.

    It is said only where a single color is in the scene and no cubes arrive later: with several
    colors, large numbers would go with certain words.
    """
    if _is_late(request.episode.scene) or len(request.scene_colors) > 1:
        return []
    cubes = request.objects_to_point_at(request.color_values[0])
    if len(cubes) - count.number != CUBES_LEFT_OVER:
        return []
    return [Clue("counts", "all but three")]


def _applies_to(task: Task) -> bool:
    """Return whether a task has anything to look at: StopCube and the real tasks do not."""
    return task.suite != "real" and task.name != "StopCube"


SETTING = Setting(
    name="grounded",
    order=5,
    summary="the introduction describes what only the scene or the video shows",
    color="#44AA99",
    content_plans="grounded",
    applies_to=_applies_to,
    refusal=refusal,
    reads=frozenset({"delivery"}),
    example=2,
    plain="direct",
)
