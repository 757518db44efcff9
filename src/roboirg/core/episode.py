"""The plain data of an episode: what is in the scene, what is wanted, and what must happen.

An episode is data and everything else is a function of it: the language describes it, the
world plays it, the judge measures it. Nothing here computes beyond looking things up.

Frames: the world frame has its origin in the middle of the work area on the table top, x away
from the robot, y to the robot's left, z up. The robot's base stands at (-0.615, 0, 0) with the
same axes, so robot-frame and world-frame directions agree. Units are meters, radians and control
steps (20 per second). Quaternions are (w, x, y, z).
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Literal, NamedTuple, get_args

from roboirg.core.conditions import Condition, Fact, Rule
from roboirg.core.motions import Motion, Point

Color = Literal["red", "green", "blue", "yellow", "gray", "purple"]
Difficulty = Literal["easy", "medium", "hard"]
Split = Literal["train", "val", "test"]
Suite = Literal["counting", "permanence", "reference", "real"]
ObjectKind = Literal[
    "cube",
    "hidden_cube",
    "container",
    "target",
    "button",
    "bin",
    "site",
    "shuttle",
    "marker",
    "box",
    "tape",
]

COLORS: tuple[Color, ...] = ("red", "green", "blue")
"""Those of cubes."""
ALL_COLORS: tuple[Color, ...] = get_args(Color)
SUITES: tuple[Suite, ...] = get_args(Suite)
BENCHMARK_SUITES: tuple[Suite, ...] = ("counting", "permanence", "reference")
"""The suites of the benchmark; the tasks of the real robot are beside it."""
DIFFICULTIES: tuple[Difficulty, ...] = ("easy", "medium", "hard")
SPLITS: tuple[Split, ...] = ("train", "val", "test")

ENVIRONMENT_VERSION = 0
"""Goes up whenever scores could change: scenes, rules, physics, observations."""

ROBOT_BASE = (-0.615, 0.0, 0.0)
"""Position of the Panda's base link in the world frame, meters; its rotation is the identity."""

SlotValue = str | int | tuple[str, ...] | tuple[int, ...]


@dataclass(frozen=True, slots=True)
class SceneObject:
    """One thing on the table, at its place at the start.

    Attributes:
        name: unique in the scene, for example ``"cube_red"`` or ``"container_2"``.
        kind: what it is; shape and mass follow from the kind, `radius` and `thickness`. A ``site``
            is a round place that nobody sees, a ``shuttle`` a cube that runs by itself and touches
            nothing, a ``marker`` a disc that lights up over a target, a ``box`` an open box that
            stands fast, a ``tape`` a roll of adhesive tape that lies flat.
        position: of the object's origin, world frame, meters.
        yaw: rotation about the vertical, radians.
        color: of a cube, box or tape; None for things whose color tells nothing.
        inside: name of the container that stands over this (hidden) cube, else None.
        radius: of a target, site or marker, meters; None for the other kinds.
        thickness: of a target, meters; None for the usual 0.005.
        rgb: 0 to 1 each, of a target's rings or a shuttle; None for the usual of the kind.
    """

    name: str
    kind: ObjectKind
    position: Point
    yaw: float = 0.0
    color: Color | None = None
    inside: str | None = None
    radius: float | None = None
    thickness: float | None = None
    rgb: tuple[float, float, float] | None = None


@dataclass(frozen=True, slots=True)
class Scene:
    """What is on the table at the start, and what happens there by itself.

    Attributes:
        objects: in the order in which they were placed.
        motions: scripted movements.
        past: what the video shows being done, in order; empty where it shows nothing done.
    """

    objects: tuple[SceneObject, ...]
    motions: tuple[Motion, ...] = ()
    past: tuple[Fact, ...] = ()

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

    Slots by task: BinFill ``colors`` (one to three names, in the order red, blue, green) and
    ``counts`` (a number for each); PickXtimes and SwingXtimes ``color`` and ``repeats``; StopCube
    ``visit`` (2 for the second); the four Unmask tasks ``colors`` (one or two names, in the order
    of picking); VideoRepick ``repeats``; VideoPlaceButton ``color`` and ``relation`` (before or
    after); VideoPlaceOrder ``color`` and ``placement`` (1 for the first); PutInBox ``color`` (of
    the box); PickByCount ``color`` (of the tape) and ``repeats``.
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
        return tuple(str(word) for word in value)

    def numbers(self, slot: str) -> tuple[int, ...]:
        """The value of a slot that holds several counts in order."""
        value = self[slot]
        if not isinstance(value, tuple):
            raise TypeError(f"slot {slot!r} holds {value!r}, not a sequence of numbers")
        return tuple(int(number) for number in value)

    def as_mapping(self) -> Mapping[str, SlotValue]:
        """The slots as a dictionary, for records."""
        return dict(self.slots)


class Primitive(NamedTuple):
    """How the oracle's hands do a stage.

    | kind | subject, place | movement |
    | --- | --- | --- |
    | ``pick_cube`` | cube or tape | grasp it and lift it |
    | ``place_on`` | cube or tape, target or site | put what is held there |
    | ``drop_into`` | cube, bin | let what is held fall in, and retreat |
    | ``put_into`` | tape, box | let go of what is held right above the rim, and up |
    | ``move_over`` | cube, target | carry what is held over the place |
    | ``put_down`` | cube or container | straight down, let go at the tool height `height`, up |
    | ``pick_container`` | container | grasp its knob and lift it |
    | ``press`` | button | above it, down and up with closed fingers |
    | ``press_below`` | button | from where the hand is; at `steps` since reset at best |
    | ``hover`` | button | above it with closed fingers |
    | ``hold`` | ``"robot"`` | stay for `steps` with an open gripper |
    | ``hold_until`` | ``"robot"`` | stay until `steps` since reset with closed fingers |
    | ``retreat`` | ``"robot"`` | away from the table's things, then as ``hold`` |
    | ``go_home`` | ``"robot"`` | to the home position |

    Attributes:
        kind: the movement; its way points are in the simulation room.
        subject: what is handled (an object's name).
        place: where it goes.
        steps: how long, in control steps.
        height: of the tool where it lets go, m, for ``put_down``.
    """

    kind: Literal[
        "pick_cube",
        "place_on",
        "drop_into",
        "put_into",
        "move_over",
        "put_down",
        "pick_container",
        "press",
        "press_below",
        "hover",
        "hold",
        "hold_until",
        "retreat",
        "go_home",
    ]
    subject: str
    place: str | None = None
    steps: int = 0
    height: float = 0.07


@dataclass(frozen=True, slots=True)
class Stage:
    """One step of the plan: what must happen next, what must not, how, and how it is called.

    Attributes:
        expects: the condition that completes the stage.
        forbids: facts and rules any of which fails the episode while this stage is current.
        primitive: how the oracle does it.
        subgoal: simple subgoal in words, lower case; ``{at}`` marks where the grounded form
            puts ``at <y, x>``.
        points_at: the object whose pixel the grounded form names; None if it has no slot.
        lasting: how many control steps `expects` has to hold before the stage is complete.
        timer: name of the timer that the stage's first evaluation starts, unless it runs already.
        recorded: whether the stage is in the video, if it is part of the demonstration.
    """

    expects: Condition
    forbids: tuple[Fact | Rule, ...]
    primitive: Primitive
    subgoal: str
    points_at: str | None = None
    lasting: int = 0
    timer: str | None = None
    recorded: bool = True


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
        scene: objects at the start and what they do by themselves.
        goal: what the instruction must convey.
        stages: what the policy must do, in order.
        demonstration: stages that the oracle plays before the policy's turn; may be empty.
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

    @property
    def key(self) -> str:
        """The episode's short unique name."""
        return episode_key(self.task, self.split, self.index)
