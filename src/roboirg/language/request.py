"""The request to put an episode into words, and what a setting returns for it.

A slot is a part of the goal, ``colors``; it holds one value or several. A field is the place of a
single value in a command: ``colors.1`` for the second color, ``color`` for the only one.
"""

from __future__ import annotations

import functools
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Literal, NamedTuple, cast

from roboirg.core.episode import (
    Episode,
    Goal,
    Scene,
    SceneObject,
    SlotValue,
    values_in,
)
from roboirg.core.goal_slots import COLOR_SLOTS, SLOT_TYPE_NAMES, SlotTypeName
from roboirg.core.instruction_options import InstructionOptions
from roboirg.core.word_pools import PoolName, pool_of
from roboirg.language.goal_fields import fields_of
from roboirg.language.instruction import Meaning, UtteranceStage
from roboirg.language.landmarks import Frame, things_of_color
from roboirg.language.phrases import Phrase
from roboirg.language.word_sampler import WordSampler
from roboirg.tasks import Task, get_task

Distractor = Literal["neutral", "competing"]
DISTRACTORS: tuple[Distractor, ...] = ("neutral", "competing")
MOST_DISTRACTORS = 100
STAGE_SETS: tuple[tuple[int, ...], ...] = ((1, 5), (1, 2, 5), (1, 2, 3, 5), (1, 2, 3, 4, 5))

AMOUNT_FIELD = "cubes"
"""The field of our commands that holds all colors with their counts."""


class GoalValue(NamedTuple):
    """One value of a goal, with its place in the goal and in commands.

    Of a goal of red and blue: ``GoalValue("colors.1", "colors", "color", "blue")``.

    Attributes:
        field: its field in the task's commands, ``repeats`` or ``colors.1``.
        slot: name of the goal slot, ``colors``.
        slot_type: type of the slot, ``color``; ``amount`` for colors that have counts.
        value: the value.
    """

    field: str
    slot: str
    slot_type: SlotTypeName
    value: str | int

    @property
    def color(self) -> str:
        """The value as a color; only for values that are one."""
        return str(self.value)

    @property
    def number(self) -> int:
        """The value as a number; only for values that are one."""
        return int(self.value)


GoalValues = tuple[GoalValue, ...]
"""Values of a goal, in the order of its slots."""


@dataclass(frozen=True, slots=True)
class InstructionRequest:
    """An episode that is to be said, with the options of its words and the random choice of them.

    Attributes:
        episode: the episode.
        task: its task.
        options: valid ones; see `roboirg.language.instruct`.
        sampler: draws the words, and keeps a log of the draws.
    """

    episode: Episode
    task: Task
    options: InstructionOptions
    sampler: WordSampler

    @property
    def resolved(self) -> bool:
        """Whether the command names what its pronouns stand for: *the red cube*, not *it*."""
        return self.options.form == "resolved"

    @property
    def pool(self) -> PoolName:
        """The pool from which the words are taken: ``train`` or ``test``."""
        return pool_of(self.episode.split, self.options.wordings)

    @property
    def frame(self) -> Frame:
        """Whose left and right the words mean: ``robot`` or ``camera``."""
        return cast("Frame", self.options.frame)

    @property
    def goal_values(self) -> GoalValues:
        """The values of the goal, in the order of its slots."""
        return values_of_goal(self.episode.goal)

    def values_of(self, slot_type: SlotTypeName) -> GoalValues:
        """Return the goal's values of one type: of ``color``, red and blue. May be empty."""
        return tuple(value for value in self.goal_values if value.slot_type == slot_type)

    def values_in(self, slot: str) -> GoalValues:
        """Return the goal's values in one slot: in ``colors``, red and blue. May be empty."""
        return tuple(value for value in self.goal_values if value.slot == slot)

    def fields_in(self, name: str) -> list[str]:
        """Return the fields of the goal that a field of a command holds.

        ``color`` holds itself; ``cubes``, for goals that count cubes, holds all fields:
        ``colors.0``, ``colors.1``, ``counts.0``, ``counts.1``.
        """
        if name != AMOUNT_FIELD:
            return [name]
        return [value.field for value in self.goal_values]

    @property
    def color_values(self) -> GoalValues:
        """The goal's values that are colors, with counts or without."""
        return tuple(value for value in self.goal_values if value.slot in COLOR_SLOTS)

    def alternatives(self, slot: str) -> tuple[tuple[str | int, ...], ...]:
        """Return all that a slot can hold in this scene if the other slots keep their values.

        In a scene of red and blue cubes, ``color`` gives ``(("red",), ("blue",))``. What the goal
        has is among them.
        """
        return _alternatives(self.task.name, self.episode.scene, self.episode.goal, slot)

    @property
    def shows_color(self) -> bool:
        """Whether the video gives the goal's color away.

        It does if the robot handles things of this one color in it, and of no other.
        """
        scene = self.episode.scene
        colored = self.task.things.colored
        handled_names = {fact.subject for fact in scene.past}
        handled: set[str | None] = set()
        for item in scene.objects:
            if item.name in handled_names and item.kind in (colored, f"hidden_{colored}"):
                handled.add(item.color)
        return handled == {value.color for value in self.color_values[:1]}

    @property
    def scene_colors(self) -> tuple[str, ...]:
        """The colors that goals of this scene can have, in the order of the task's vocabulary."""
        return _scene_colors(self.task.name, self.episode.scene)

    def objects_to_point_at(self, color: GoalValue) -> tuple[SceneObject, ...]:
        """Return the cubes of a color, or the containers over them, if the task has such."""
        return things_of_color(self.episode.scene, self.task.things.pointed, color.color)


class UtteranceSpec(NamedTuple):
    """One utterance before it is written out.

    Attributes:
        stage: its part in the text, ``introduction``.
        phrase: its words, with the mentions of values among them.
    """

    stage: UtteranceStage
    phrase: Phrase


@dataclass(frozen=True, slots=True)
class InstructionSpec:
    """The words of an instruction before they are written out.

    Attributes:
        utterances: in the order of speaking; the last one is the command.
        meaning: how the values of the goal follow from the words.
        notes: entries of the metadata, such as the reasoning pattern.
    """

    utterances: tuple[UtteranceSpec, ...]
    meaning: Meaning
    notes: Mapping[str, object] = field(default_factory=dict)


# Cached: all settings and forms of an episode ask for the same.
@functools.lru_cache(maxsize=256)
def values_of_goal(goal: Goal) -> GoalValues:
    """Return the values of a goal one by one, in the order of its slots.

    A goal with the slot ``colors`` of red and blue gives red with the field ``colors.0`` and blue
    with ``colors.1``. Colors that have counts are of the type ``amount``.
    """
    found = []
    has_counts = "counts" in dict(goal.slots)
    for slot, _ in goal.slots:
        slot_type = SLOT_TYPE_NAMES[slot]
        if has_counts and slot in COLOR_SLOTS:
            slot_type = "amount"
        for name, value in fields_of(goal, slot):
            found.append(GoalValue(name, slot, slot_type, value))
    return tuple(found)


@functools.lru_cache(maxsize=64)
def _alternatives(
    task: str, scene: Scene, goal: Goal, slot: str
) -> tuple[tuple[str | int, ...], ...]:
    """Return what a slot holds in each goal of a scene that has the other slots of a given goal.

    If the scene allows the goals *red, twice*, *blue, twice* and *blue, once*, the slot ``color``
    of the first gives ``(("red",), ("blue",))``.
    """
    rest = _without_slot(goal, slot)
    goals = [other for other in get_task(task).goals(scene) if _without_slot(other, slot) == rest]
    return tuple(values_in(other[slot]) for other in goals)


def _without_slot(goal: Goal, slot: str) -> dict[str, SlotValue]:
    """Return the values of a goal by slot, without one slot."""
    return {name: value for name, value in goal.slots if name != slot}


@functools.lru_cache(maxsize=64)
def _scene_colors(task: str, scene: Scene) -> tuple[str, ...]:
    """Return the colors for which goals of a scene ask, in the order of the task's vocabulary."""
    found: set[str | int] = set()
    for goal in get_task(task).goals(scene):
        for slot, content in goal.slots:
            if slot in COLOR_SLOTS:
                found.update(values_in(content))
    return tuple(color for color in get_task(task).things.colors if color in found)
