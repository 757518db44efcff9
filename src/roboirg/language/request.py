"""The request to put an episode into words, and what a setting returns for it."""

from __future__ import annotations

import functools
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Literal, NamedTuple, TypeVar, cast

from roboirg.core.episode import Color, Episode, Goal, Scene, SceneObject, values_in
from roboirg.core.errors import InvalidValueError
from roboirg.core.goal_slots import COLOR_SLOTS, SLOT_TYPE_NAMES, SlotTypeName
from roboirg.core.instruction_options import InstructionOptions
from roboirg.core.word_pools import PoolName, Pools, pool_of
from roboirg.language.goal_fields import fields_of
from roboirg.language.instruction import Expression, Meaning, UtteranceStage
from roboirg.language.landmarks import Frame, things_of_color
from roboirg.language.phrases import (
    Mentionable,
    Phrase,
    anaphor,
    antecedent,
    fill,
)
from roboirg.language.template_sampler import TemplateSampler
from roboirg.tasks import Task, get_task

Distractor = Literal["neutral", "competing"]
Option = TypeVar("Option")
DISTRACTORS: tuple[Distractor, ...] = ("neutral", "competing")
MOST_DISTRACTORS = 100
STAGE_SETS: tuple[tuple[int, ...], ...] = ((1, 5), (1, 2, 5), (1, 2, 3, 5), (1, 2, 3, 4, 5))

AMOUNT_FIELD = "cubes"
"""The field of our commands that holds all colors with their counts."""


class GoalValue(NamedTuple):
    """One value of the goal that an instruction conveys.

    Attributes:
        field: its field in the task's commands, ``repeats`` or ``colors.1``.
        slot: name of the goal slot.
        slot_type: type of the slot.
        value: the value.
    """

    field: str
    slot: str
    slot_type: SlotTypeName
    value: str | int

    @property
    def color(self) -> str:
        """The value, if it is a color."""
        return str(self.value)

    @property
    def number(self) -> int:
        """The value, if it is a number."""
        return int(self.value)


GoalValues = tuple[GoalValue, ...]
"""Values of one type, or all of a goal, in the order of its slots."""


@dataclass(frozen=True, slots=True)
class InstructionRequest:
    """An episode, how to instruct it, and the random choice of wordings.

    Attributes:
        episode: the episode.
        task: its task.
        options: valid ones; see `roboirg.language.instruct`.
        sampler: picks the wordings.
    """

    episode: Episode
    task: Task
    options: InstructionOptions
    sampler: TemplateSampler

    @property
    def resolved(self) -> bool:
        """Whether the command names the referents of its referring expressions."""
        return self.options.form == "resolved"

    def refer(
        self, words: str, expression: Expression, referent: Mentionable, *, resolved: str
    ) -> Phrase:
        """Return words that point back at a value; resolved, those that name it."""
        if self.resolved:
            return antecedent(resolved, referent)
        return anaphor(words, expression, referent)

    @property
    def pool(self) -> PoolName:
        """The pool from which the words are taken."""
        return pool_of(self.episode.split, self.options.wordings)

    def pick(self, purpose: str, pools: Pools[Option]) -> Option:
        """Pick a wording from the pool of the request, all equally likely."""
        return self.sampler.pick(purpose, pools.of(self.pool))

    @property
    def frame(self) -> Frame:
        """The frame of left and right."""
        return cast("Frame", self.options.frame)

    @property
    def goal_values(self) -> GoalValues:
        """The values of the goal, in the order of its slots."""
        return values_of_goal(self.episode.goal)

    def values_of(self, slot_type: SlotTypeName) -> GoalValues:
        """Return the goal values of one slot type."""
        return tuple(value for value in self.goal_values if value.slot_type == slot_type)

    def values_in(self, slot: str) -> GoalValues:
        """Return the goal values of one slot."""
        return tuple(value for value in self.goal_values if value.slot == slot)

    def fields_in(self, name: str) -> list[str]:
        """Return the fields of the goal that a field of our commands holds: itself, or amounts."""
        if name != AMOUNT_FIELD:
            return [name]
        return [value.field for value in self.goal_values]

    @property
    def color_values(self) -> GoalValues:
        """The goal values that are colors, counted or not."""
        return tuple(value for value in self.goal_values if value.slot in COLOR_SLOTS)

    def count_of(self, color: GoalValue) -> int:
        """Return how many things of a color the goal wants; 1 unless it counts them."""
        wanted = color.field.replace("colors", "counts")
        for count in self.values_in("counts"):
            if count.field == wanted:
                return count.number
        return 1

    def alternatives(self, slot: str) -> tuple[tuple[str | int, ...], ...]:
        """Return all that a slot can hold in this scene if the other slots keep their values."""
        return _alternatives(self.task.name, self.episode.scene, self.episode.goal, slot)

    def alternative_numbers(self, slot: str) -> tuple[tuple[int, ...], ...]:
        """Return the alternatives of a slot that holds numbers."""
        return tuple(tuple(map(int, content)) for content in self.alternatives(slot))

    @property
    def shows_color(self) -> bool:
        """Whether the video shows the robot handle a thing of the goal's color, and no other."""
        scene = self.episode.scene
        kinds = (self.task.commands.colored, f"hidden_{self.task.commands.colored}")
        subjects = {fact.subject for fact in scene.past}
        handled = {one.color for one in scene.objects if one.name in subjects and one.kind in kinds}
        return handled == {one.color for one in self.color_values[:1]}

    @property
    def scene_colors(self) -> tuple[str, ...]:
        """The colors that goals of this scene can have, in the order of the task's vocabulary."""
        return _scene_colors(self.task.name, self.episode.scene)

    def other_colors(self, color: str) -> tuple[Color, ...]:
        """Return the colors in the task's vocabulary, without this one."""
        colors = self.task.commands.colors
        if color not in colors:
            raise InvalidValueError(
                f"{color!r} is not a color of {self.task.name}; its colors are {', '.join(colors)}."
            )
        return tuple(other for other in colors if other != color)

    def by_color(self, cube: Phrase) -> Phrase:
        """Return words for the object to handle, given words for its cube: *that one*.

        Where a container is handled, they become *the container over that one*.
        """
        return fill(self.task.commands.by_color, {"cube": cube})

    def by_place(
        self, color: GoalValue, place: Phrase, *, plural: bool = False, template: str | None = None
    ) -> Phrase:
        """Return words for the object to handle, given words for its place.

        `template` has ``{place}`` and the words around it; None for those of the task.
        """
        commands = self.task.commands
        template = template or commands.by_place
        if color != self.color_values[0] or len(self.color_values) > 2:  # noqa: PLR2004
            # "Two cubes like the one here and one like the one there"; of three, none says cube.
            template = template.removeprefix(f"{commands.thing}[|s] ")
        return fill(template, {"place": place}, plural=plural)

    def objects_to_point_at(self, color: GoalValue) -> tuple[SceneObject, ...]:
        """Return the cubes of a color, or the containers over them."""
        return things_of_color(self.episode.scene, self.task.commands.pointed, color.color)

    def command(self, fields: Mapping[str, Phrase]) -> Phrase:
        """Fill the task's command, which has the same wording in all settings."""
        handled = max(1, len(self.values_of("color")))
        wordings = self.task.commands.wordings.of(self.pool)
        possible = [one for one in wordings if one.parts == handled]
        return fill(self.sampler.pick(f"command-{handled}", possible).text, fields)


class UtteranceSpec(NamedTuple):
    """One utterance: its stage, and its words with their mentions."""

    stage: UtteranceStage
    phrase: Phrase


@dataclass(frozen=True, slots=True)
class InstructionSpec:
    """The words of an instruction.

    Attributes:
        utterances: in the order of speaking; the last one is the command.
        notes: entries of the metadata.
        meaning: by declaration; None if none is declared.
    """

    utterances: tuple[UtteranceSpec, ...]
    notes: Mapping[str, object] = field(default_factory=dict)
    meaning: Meaning | None = None


# Cached: all settings and forms of an episode ask for the same.
@functools.lru_cache(maxsize=256)
def values_of_goal(goal: Goal) -> GoalValues:
    """Return the values of a goal, in the order of its slots."""
    found: list[GoalValue] = []
    counted = "counts" in dict(goal.slots)
    for slot, _ in goal.slots:
        slot_type = "amount" if counted and slot in COLOR_SLOTS else SLOT_TYPE_NAMES[slot]
        found += [GoalValue(name, slot, slot_type, value) for name, value in fields_of(goal, slot)]
    return tuple(found)


@functools.lru_cache(maxsize=64)
def _alternatives(
    task: str, scene: Scene, goal: Goal, slot: str
) -> tuple[tuple[str | int, ...], ...]:
    same = dict(goal.slots) | {slot: 0}
    goals = [dict(one.slots) for one in get_task(task).goals(scene)]
    values = [one[slot] for one in goals if one | {slot: 0} == same]
    return tuple(map(values_in, values))


@functools.lru_cache(maxsize=64)
def _scene_colors(task: str, scene: Scene) -> tuple[str, ...]:
    found = {
        color
        for goal in get_task(task).goals(scene)
        for slot, content in goal.slots
        if slot in COLOR_SLOTS
        for color in values_in(content)
    }
    return tuple(color for color in get_task(task).commands.colors if color in found)
