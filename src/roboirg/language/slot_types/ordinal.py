"""Ordinals: which visit of the moving cube, or which placement in the video."""

from __future__ import annotations

from roboirg.core.motions import Shuttle
from roboirg.language import templates
from roboirg.language.number_words import ordinal
from roboirg.language.phrases import Phrase, anaphor, antecedent, fill, plain
from roboirg.language.request import GoalValue, InstructionRequest
from roboirg.language.slot_types.slot_type import Fields, SlotType, rival_sentences

INTRODUCTIONS = {
    "visit": templates.VISIT_INTRODUCTIONS,
    "placement": templates.PLACEMENT_INTRODUCTIONS,
}
WRAPPED = {"visit": "{which}", "placement": "the target of {which}"}
"""The field of the command around the words for the element of the series."""
OWNERS = {"visit": "its", "placement": "the"}
"""Whose element it is; *its placement* would tell which cube is meant, as only one was placed."""
VISITS = (1, 2, 3, 4, 5)
PLACEMENTS = (1, 2, 3, 4)
"""Positions that a remark may name."""


def series_length(request: InstructionRequest, part: GoalValue) -> int:
    """How many elements the episode's series has: visits to come, or placements shown."""
    scene = request.episode.scene
    if part.kind == "visit":
        return sum(motion.passes for motion in scene.motions if isinstance(motion, Shuttle))
    targets = {target.name for target in scene.of_kind("target")}
    return sum(fact.kind == "placed" and fact.place in targets for fact in scene.past)


def wrapped(part: GoalValue, which: Phrase) -> Fields:
    """The command's field of an ordinal, given the words for the visit or placement."""
    return {part.field: fill(WRAPPED[part.kind], {"which": which})}


def _stated(_request: InstructionRequest, parts: tuple[GoalValue, ...]) -> Fields:
    """``its third visit``, ``the second placement``."""
    (part,) = parts
    words = f"{OWNERS[part.kind]} {ordinal(part.number)} {part.kind}"
    return wrapped(part, antecedent(words, part.slot, part.value))


def _reduced(request: InstructionRequest, parts: tuple[GoalValue, ...]) -> Fields:
    """``that visit``."""
    return wrapped(parts[0], _pointing(request, parts))


def _introduce(request: InstructionRequest, parts: tuple[GoalValue, ...]) -> Phrase:
    return introduce_position(request, parts[0], parts[0].slot, parts[0].number)


def introduce_position(
    request: InstructionRequest, part: GoalValue, slot: str, position: int
) -> Phrase:
    """A sentence that names any element of a part's series."""
    template = request.chooser.pick(f"{part.kind} introduction", INTRODUCTIONS[part.kind])
    which = antecedent(f"the {ordinal(position)} {part.kind}", slot, position)
    return fill(template, {"which": which})


def by_number(part: GoalValue, value: Phrase) -> Fields:
    """``the visit whose number is ...``."""
    return wrapped(part, (*plain(f"the {part.kind} whose number is "), *value))


def _pointing(_request: InstructionRequest, parts: tuple[GoalValue, ...]) -> Phrase:
    (part,) = parts
    return anaphor(f"that {part.kind}", "that", part.slot, part.value)


def _visit_rivals(_request: InstructionRequest, parts: tuple[GoalValue, ...]) -> list[Phrase]:
    return rival_sentences(templates.COMPETING_VISIT_DISTRACTORS, VISITS, _word, parts)


def _placement_rivals(_request: InstructionRequest, parts: tuple[GoalValue, ...]) -> list[Phrase]:
    return rival_sentences(templates.COMPETING_PLACEMENT_DISTRACTORS, PLACEMENTS, _word, parts)


def _word(value: str | int) -> str:
    return ordinal(int(value))


VISIT = SlotType(
    name="visit",
    stated=_stated,
    reduced=_reduced,
    introduce=_introduce,
    pointing=_pointing,
    reinforcements=templates.VISIT_REINFORCEMENTS,
    rivals=_visit_rivals,
)
PLACEMENT = SlotType(
    name="placement",
    stated=_stated,
    reduced=_reduced,
    introduce=_introduce,
    pointing=_pointing,
    reinforcements=templates.VIDEO_REINFORCEMENTS,
    rivals=_placement_rivals,
)
