"""The plain data of an episode: what is in the scene, what is wanted, and what must happen.

An episode is data and everything else is a function of it: the language describes it, the
world plays it, the judge measures it. Nothing here computes beyond looking things up.

Frames: the world frame has its origin in the middle of the work area on the table top, x away
from the robot, y to the robot's left, z up. The robot's base stands at (-0.615, 0, 0) with the
same axes, so robot-frame and world-frame directions agree. Units are metres, radians and control
steps (20 per second). Quaternions are (w, x, y, z).
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Literal, NamedTuple

Colour = Literal["red", "green", "blue"]
Difficulty = Literal["easy", "medium", "hard"]
Split = Literal["train", "val", "test"]
Suite = Literal["counting", "permanence", "reference"]
ObjectKind = Literal["cube", "hidden_cube", "container", "target", "button"]

COLOURS: tuple[Colour, ...] = ("red", "green", "blue")
DIFFICULTIES: tuple[Difficulty, ...] = ("easy", "medium", "hard")
SPLITS: tuple[Split, ...] = ("train", "val", "test")

ENVIRONMENT_VERSION = 0
"""Goes up whenever scores could change: scenes, rules, physics, observations."""

ROBOT_BASE = (-0.615, 0.0, 0.0)
"""Position of the Panda's base link in the world frame, metres; its rotation is the identity."""

SlotValue = str | int | tuple[str, ...]


class Point(NamedTuple):
    """A position in the world frame, metres."""

    x: float
    y: float
    z: float


@dataclass(frozen=True, slots=True)
class SceneObject:
    """One thing on the table, at its place at the start.

    Attributes:
        name: unique in the scene, for example ``"cube_red"`` or ``"container_2"``.
        kind: what it is; shape and mass follow from the kind and `radius`.
        position: of the object's origin, world frame, metres.
        yaw: rotation about the vertical, radians.
        colour: of a cube; None for things whose colour tells nothing.
        inside: name of the container that stands over this (hidden) cube, else None.
        radius: of a target disc, metres; None for the other kinds.
    """

    name: str
    kind: ObjectKind
    position: Point
    yaw: float = 0.0
    colour: Colour | None = None
    inside: str | None = None
    radius: float | None = None


@dataclass(frozen=True, slots=True)
class Scene:
    """All objects of an episode, in the order in which they were placed."""

    objects: tuple[SceneObject, ...]

    def __getitem__(self, name: str) -> SceneObject:
        """The object of that name; KeyError if there is none."""
        for item in self.objects:
            if item.name == name:
                return item
        raise KeyError(name)

    def of_kind(self, kind: ObjectKind) -> tuple[SceneObject, ...]:
        """All objects of one kind, in scene order."""
        return tuple(item for item in self.objects if item.kind == kind)

    def hidden_in(self, container: str) -> SceneObject | None:
        """The cube under the named container, or None if that container is empty."""
        return next((item for item in self.objects if item.inside == container), None)


@dataclass(frozen=True, slots=True)
class Goal:
    """What an instruction must convey: a value for each slot. Goals compare by value.

    Slots by task: PickXtimes ``colour`` (str) and ``repeats`` (int); VideoUnmask ``colours``
    (tuple of one or two colour names, in the order of picking).
    """

    slots: tuple[tuple[str, SlotValue], ...]

    @classmethod
    def of(cls, **slots: SlotValue) -> Goal:
        """A goal from keyword arguments, slots kept in the order given."""
        return cls(tuple(slots.items()))

    def __getitem__(self, slot: str) -> SlotValue:
        """The value of a slot; KeyError if the goal has no such slot."""
        return dict(self.slots)[slot]

    def number(self, slot: str) -> int:
        """The value of a slot that holds a count or an ordinal."""
        value = self[slot]
        if not isinstance(value, int):
            raise TypeError(f"slot {slot!r} holds {value!r}, not a number")
        return value

    def text(self, slot: str) -> str:
        """The value of a slot that holds one word."""
        value = self[slot]
        if not isinstance(value, str):
            raise TypeError(f"slot {slot!r} holds {value!r}, not a word")
        return value

    def texts(self, slot: str) -> tuple[str, ...]:
        """The value of a slot that holds several words in order."""
        value = self[slot]
        if not isinstance(value, tuple):
            raise TypeError(f"slot {slot!r} holds {value!r}, not a sequence of words")
        return value

    def as_mapping(self) -> Mapping[str, SlotValue]:
        """The slots as a dictionary, for records."""
        return dict(self.slots)


class Fact(NamedTuple):
    """Something that is true in the world at one evaluation, one after each control step.

    | kind | true while |
    | --- | --- |
    | ``picked`` | the cube is above z 0.05 and grasped |
    | ``placed`` | the cube lies released (z <= 0.035) within 0.05 of the `place` (xy) |
    | ``lifted`` | the container's origin is above z 0.15 |
    | ``put_down`` | the container's origin is at or below z 0.07, released, hand above z 0.05 |
    | ``pressed`` | the button's cap is more than 0.005 down |
    | ``still`` | no arm joint moves faster than 0.2 rad/s (subject ``"robot"``) |

    Thresholds: RoboMME, evaluation mode.
    """

    kind: Literal["picked", "placed", "lifted", "put_down", "pressed", "still"]
    subject: str
    place: str | None = None


class Primitive(NamedTuple):
    """How the oracle's hands do a stage.

    Attributes:
        kind: the movement; its way points are in the simulation room.
        subject: what is handled (an object's name; ``"robot"`` for ``hold``).
        place: where it goes, for ``place_on``.
        steps: how long, in control steps, for ``hold``.
    """

    kind: Literal["pick_cube", "place_on", "press", "pick_container", "put_down", "hold"]
    subject: str
    place: str | None = None
    steps: int = 0


@dataclass(frozen=True, slots=True)
class Stage:
    """One step of the plan: what must happen next, what must not, how, and how it is called.

    Attributes:
        expects: the fact that completes the stage.
        forbids: facts any of which fails the episode while this stage is current.
        primitive: how the oracle does it.
        subgoal: simple subgoal in words, lower case; ``{at}`` marks where the grounded form
            puts ``at <y, x>``.
        points_at: the object whose pixel the grounded form names; None if it has no slot.
        lasting: how many control steps `expects` has to hold before the stage is complete.
    """

    expects: Fact
    forbids: tuple[Fact, ...]
    primitive: Primitive
    subgoal: str
    points_at: str | None = None
    lasting: int = 0


class KeyPose(NamedTuple):
    """From control step `step` on, the object is held at `position`; None releases it at its place.

    The place is the object's position and yaw in the scene.
    """

    step: int
    position: Point | None


@dataclass(frozen=True, slots=True)
class Motion:
    """Scripted movement of one object, whatever the robot does.

    Attributes:
        subject: name of the object.
        keys: in the order of their steps (elapsed control steps before the physics of a step).
    """

    subject: str
    keys: tuple[KeyPose, ...]


def episode_key(task: str, split: Split, index: int) -> str:
    """The name of an episode, for example ``"PickXtimes/test/3"``."""
    return f"{task}/{split}/{index}"


@dataclass(frozen=True, slots=True)
class Episode:
    """One episode: everything that determines it and everything it determines.

    Attributes:
        task: name of the task.
        split: the split it belongs to.
        index: 0-based position in the split.
        seed: of the scene sampler.
        difficulty: of the scene sampler.
        scene: objects at the start.
        goal: what the instruction must convey.
        stages: what the policy must do, in order.
        demonstration: stages that the oracle plays before the policy's turn; may be empty.
        motions: scripted movements, in steps since reset.
    """

    task: str
    split: Split
    index: int
    seed: int
    difficulty: Difficulty
    scene: Scene
    goal: Goal
    stages: tuple[Stage, ...]
    demonstration: tuple[Stage, ...] = ()
    motions: tuple[Motion, ...] = field(default=())

    @property
    def key(self) -> str:
        """The episode's short unique name."""
        return episode_key(self.task, self.split, self.index)
