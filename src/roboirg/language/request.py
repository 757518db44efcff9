"""What a setting is asked for, and what it hands back."""

from __future__ import annotations

import functools
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Literal, NamedTuple

from roboirg.core.episode import Color, Episode, Goal, Scene, SceneObject
from roboirg.core.errors import InvalidValueError
from roboirg.language.instruction import Form, UtteranceStage
from roboirg.language.landmarks import Frame
from roboirg.language.phrases import Phrase, fill
from roboirg.language.template_sampler import TemplateSampler
from roboirg.tasks import Task, get_task

Distractor = Literal["neutral", "competing"]
DISTRACTORS: tuple[Distractor, ...] = ("neutral", "competing")
STAGE_SETS: tuple[tuple[int, ...], ...] = ((1, 5), (1, 2, 5), (1, 2, 3, 5), (1, 2, 3, 4, 5))

SlotTypeName = Literal["number", "visit", "placement", "relation", "color", "amount"]
SLOT_TYPE_NAMES: Mapping[str, SlotTypeName] = {
    "color": "color",
    "colors": "color",
    "counts": "amount",
    "repeats": "number",
    "visit": "visit",
    "placement": "placement",
    "relation": "relation",
}
"""What kind of value each goal slot holds; colors that have counts are amounts with them."""
COLOR_SLOTS = ("color", "colors")


class GoalValue(NamedTuple):
    """One value of the goal that an instruction has to convey.

    Attributes:
        field: its field in the task's commands, ``repeats`` or ``colors.1``.
        slot: name of the goal slot.
        kind: what kind of value it is.
        value: the value.
    """

    field: str
    slot: str
    kind: SlotTypeName
    value: str | int

    @property
    def color(self) -> str:
        """The value of a part that is a color."""
        return str(self.value)

    @property
    def number(self) -> int:
        """The value of a part that is a number."""
        return int(self.value)


@dataclass(frozen=True, slots=True)
class InstructionRequest:
    """What is to be put into words, and how; see `instruct` for the options."""

    episode: Episode
    task: Task
    form: Form
    stages: tuple[int, ...]
    distractor: Distractor
    distractors: int
    frame: Frame
    chooser: TemplateSampler

    @property
    def resolved(self) -> bool:
        """Whether the command is to name what its referring expressions stand for."""
        return self.form == "resolved"

    @property
    def parts(self) -> tuple[GoalValue, ...]:
        """The values of the goal, in the order of its slots."""
        return _parts(self.episode.goal)

    def parts_of(self, kind: SlotTypeName) -> tuple[GoalValue, ...]:
        """The parts of one kind."""
        return tuple(part for part in self.parts if part.kind == kind)

    @property
    def colored(self) -> tuple[GoalValue, ...]:
        """The parts that are colors, counted or not."""
        return tuple(part for part in self.parts if part.slot in COLOR_SLOTS)

    def count_of(self, color: GoalValue) -> int:
        """How many things of a color are wanted; one unless the goal counts them."""
        _, _, index = color.field.partition(".")
        counts = {part.field: part for part in self.parts if part.slot == "counts"}
        return counts[f"counts.{index}"].number if counts else 1

    def numbers_instead(self, slot: str) -> tuple[tuple[int, ...], ...]:
        """What a slot of numbers could hold in this scene, all other slots being as they are."""
        return _numbers_instead(self.task.name, self.episode.scene, self.episode.goal, slot)

    def other_colors(self, color: str) -> tuple[Color, ...]:
        """The colors that the task speaks of, without this one."""
        colors = self.task.commands.colors
        if color not in colors:
            raise InvalidValueError(
                f"{color!r} is no color of {self.task.name}; its colors are {', '.join(colors)}."
            )
        return tuple(other for other in colors if other != color)

    def by_color(self, cube: Phrase) -> Phrase:
        """The thing to handle, told by its cube."""
        return fill(self.task.commands.by_color, {"cube": cube})

    def by_place(self, place: Phrase, *, plural: bool = False) -> Phrase:
        """The thing to handle, told by its place."""
        return fill(self.task.commands.by_place, {"place": place}, plural=plural)

    def targets(self, part: GoalValue) -> tuple[SceneObject, ...]:
        """The objects that a color part may want handled: cubes, or the container over one."""
        scene = self.episode.scene
        cubes = [item for item in scene.objects if item.color == part.value]
        return tuple(cube if cube.inside is None else scene[cube.inside] for cube in cubes)

    def command(self, fields: Mapping[str, Phrase]) -> Phrase:
        """The task's command with its fields filled; the same wording in all settings."""
        handled = max(1, len(self.parts_of("color")))
        wordings = [one for one in self.task.commands.wordings if one.parts == handled]
        return fill(self.chooser.pick(f"command-{handled}", wordings).text, fields)


class UtteranceSpec(NamedTuple):
    """One utterance to be."""

    stage: UtteranceStage
    phrase: Phrase


@dataclass(frozen=True, slots=True)
class InstructionSpec:
    """What a setting says, in order, and what it wants noted in the metadata."""

    said: tuple[UtteranceSpec, ...]
    notes: Mapping[str, object] = field(default_factory=dict)


# Kept, because the settings and forms of an episode ask the same.
@functools.lru_cache(maxsize=256)
def _parts(goal: Goal) -> tuple[GoalValue, ...]:
    parts: list[GoalValue] = []
    counted = "counts" in dict(goal.slots)
    for slot, value in goal.slots:
        kind = "amount" if counted and slot in COLOR_SLOTS else SLOT_TYPE_NAMES[slot]
        if isinstance(value, tuple):
            several: tuple[str | int, ...] = value
            fields = (f"{slot}.{index}" for index in range(len(several)))
            parts += [
                GoalValue(field, slot, kind, one)
                for field, one in zip(fields, several, strict=True)
            ]
        else:
            parts.append(GoalValue(slot, slot, kind, value))
    return tuple(parts)


@functools.lru_cache(maxsize=64)
def _numbers_instead(task: str, scene: Scene, goal: Goal, slot: str) -> tuple[tuple[int, ...], ...]:
    mine = dict(goal.slots) | {slot: 0}
    choices = [dict(one.slots) for one in get_task(task).goals(scene)]
    values = [choice[slot] for choice in choices if choice | {slot: 0} == mine]
    return tuple(
        tuple(int(one) for one in (value if isinstance(value, tuple) else (value,)))
        for value in values
    )
