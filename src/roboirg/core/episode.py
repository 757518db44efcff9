"""The plain data of an episode: its scene, its goal and its stages.

An episode is data and everything else is a function of it: the language describes it, the
world plays it, the judge measures it. Nothing here computes beyond lookups.

Frames: the world frame has its origin in the middle of the work area on the table top, x away
from the robot, y to the robot's left, z up. The robot's base stands at (-0.615, 0, 0) with the
same axes, so robot-frame and world-frame directions agree. Units are meters, radians and control
steps (20 per second). Quaternions are (w, x, y, z).
"""

from __future__ import annotations

import itertools
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from typing import Any, Literal, NamedTuple, TypeVar, get_args

from roboirg.core.conditions import Condition, Fact, Rule
from roboirg.core.motions import Motion, Point
from roboirg.core.object_sizes import HALF_WIDTHS

Color = Literal["red", "green", "blue", "yellow", "gray", "purple"]
Difficulty = Literal["easy", "medium", "hard"]
Split = str
"""One of `SPLITS`, ``random``, or a private split such as ``random@1a2b3c4d5e6f``."""
Suite = str
"""One of `SUITES`, or the suite of another package's tasks."""
ObjectKind = str
"""A key of `roboirg.simulation.bodies.BODY_BUILDERS`."""

COLORS: tuple[Color, ...] = ("red", "green", "blue")
"""Colors of cubes."""
ALL_COLORS: tuple[Color, ...] = get_args(Color)
BENCHMARK_SUITES: tuple[Suite, ...] = ("counting", "permanence", "reference")
SUITES: tuple[Suite, ...] = (*BENCHMARK_SUITES, "real")
"""The suites of this package. The tasks of the real robot are not part of the benchmark."""
DIFFICULTIES: tuple[Difficulty, ...] = ("easy", "medium", "hard")
SPLITS: tuple[Split, ...] = ("train", "val", "test")
"""The splits of fixed episodes. ``random`` holds any number of episodes, drawn from their seeds."""

ENVIRONMENT_VERSION = 1
"""Increases with any change of scenes, rules, physics or observations that could change scores."""

ROBOT_BASE = (-0.615, 0.0, 0.0)
"""Position of the Panda's base link in the world frame, meters; its rotation is the identity."""

SlotValue = str | int | tuple[str, ...] | tuple[int, ...]
Value = TypeVar("Value")


def _times(number: object) -> str:
    """Return a number of repetitions in words."""
    if number == 1:
        return "once"
    if number == 2:  # noqa: PLR2004
        return "twice"
    return f"{number} times"


_SLOT_WORDS: Mapping[str, Callable[[Any], str]] = {
    "repeats": _times,
    "visit": "on visit {}".format,
    "placement": "on target {} of the video".format,
    "relation": "on the target {} the press".format,
}
"""Words for the values of slots that do not speak for themselves."""


def values_in(content: SlotValue) -> tuple[str | int, ...]:
    """Return the values of a slot, a named part of a goal, as a tuple: ``"red"`` -> ``("red",)``.

    A slot holds one value or several; what was read from a file has lists instead of tuples.
    """
    return tuple(content) if isinstance(content, tuple | list) else (content,)


def describe_goal(goal: Mapping[str, Any]) -> str:
    """Return a goal, or what a model takes for one, in words.

    ``{"color": "red", "repeats": 3}`` -> ``"red, 3 times"``; ``{"colors": ["red", "blue"],
    "counts": [2, 1]}`` -> ``"2 red, 1 blue"``. Counted colors come last. Never fails: values of a
    model that fit no slot are shown as they are.
    """
    has_amounts = "colors" in goal and "counts" in goal
    words = []
    for slot, content in goal.items():
        if not has_amounts or slot not in ("colors", "counts"):
            in_words = _SLOT_WORDS.get(slot, str)
            words += [in_words(value) for value in values_in(content)]
    if has_amounts:
        counts = values_in(goal["counts"])
        # A model may give more counts than colors, or fewer.
        pairs = itertools.zip_longest(counts, values_in(goal["colors"]), fillvalue="?")
        words += [f"{count} {color}" for count, color in pairs]
    return ", ".join(words)


@dataclass(frozen=True, slots=True)
class SceneObject:
    """One object on the table, at its place at the start.

    Attributes:
        name: unique in the scene, for example ``"cube_red"`` or ``"container_2"``.
        kind: shape and mass follow from the kind, `radius` and `thickness`. A ``site`` is an
            invisible round place, a ``shuttle`` a cube that moves by itself and touches nothing, a
            ``marker`` a disc that lights up over a target, a ``box`` an open box fixed to the
            table, a ``tape`` a roll of adhesive tape that lies flat.
        position: of the object's origin, world frame, meters.
        yaw: rotation about the vertical, radians.
        color: of a cube, box or tape; None for objects whose color means nothing.
        inside: name of the container that stands over this (hidden) cube, else None.
        radius: of a target, site or marker, meters; None for the other kinds.
        thickness: of a target, meters; None for the usual 0.005.
        rgb: 0 to 1 each, of a target's rings or a shuttle; None for the color of the kind.
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

    @property
    def half_width(self) -> float:
        """Half its width in the plane, m; 0 for kinds that are not known here."""
        return self.radius or HALF_WIDTHS.get(self.kind, 0.0)


@dataclass(frozen=True, slots=True)
class Scene:
    """The objects at the start, and their movements that do not depend on the robot.

    Attributes:
        objects: in the order in which they were placed.
        motions: scripted movements.
        past: the acts that the video shows, in order; empty if it shows none.
        color_order: the order in which stages take the colors of the goal; empty for the goal's.
    """

    objects: tuple[SceneObject, ...]
    motions: tuple[Motion, ...] = ()
    past: tuple[Fact, ...] = ()
    color_order: tuple[Color, ...] = ()

    def __getitem__(self, name: str) -> SceneObject:
        """Return the object of that name; KeyError if there is none."""
        for item in self.objects:
            if item.name == name:
                return item
        raise KeyError(name)

    def of_kind(self, kind: ObjectKind) -> tuple[SceneObject, ...]:
        """Return all objects of one kind, in scene order."""
        return tuple(item for item in self.objects if item.kind == kind)

    def motions_of(self, kind: type[Value]) -> tuple[Value, ...]:
        """Return all movements of one kind, in scene order."""
        return tuple(motion for motion in self.motions if isinstance(motion, kind))

    def hidden_in(self, container: str) -> SceneObject | None:
        """Return the cube under the named container, or None if there is none."""
        for item in self.objects:
            if item.inside == container:
                return item
        return None


@dataclass(frozen=True, slots=True)
class Goal:
    """The meaning of an instruction: a value for each slot. Goals compare by value.

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
        """Return a goal from keyword arguments, slots in the order given."""
        return cls(tuple(slots.items()))

    def __getitem__(self, slot: str) -> SlotValue:
        """Return the value of a slot; KeyError if the goal has no such slot."""
        return dict(self.slots)[slot]

    def number(self, slot: str) -> int:
        """Return the value of a slot that holds a count or an ordinal."""
        return self._value(slot, int)

    def text(self, slot: str) -> str:
        """Return the value of a slot that holds one word."""
        return self._value(slot, str)

    def texts(self, slot: str) -> tuple[str, ...]:
        """Return the value of a slot that holds several words in order."""
        return tuple(map(str, self._value(slot, tuple)))

    def numbers(self, slot: str) -> tuple[int, ...]:
        """Return the value of a slot that holds several counts in order."""
        return tuple(map(int, self._value(slot, tuple)))

    @property
    def amounts(self) -> tuple[tuple[str, int], ...]:
        """Each color with its count, of a goal that counts cubes."""
        return tuple(zip(self.texts("colors"), self.numbers("counts"), strict=True))

    def _value(self, slot: str, kind: type[Value]) -> Value:
        """Return the value of a slot; raises TypeError if it is not of type `kind`."""
        value = self[slot]
        if not isinstance(value, kind):
            raise TypeError(f"slot {slot!r} holds {value!r}, which is no {kind.__name__}")
        return value

    def as_mapping(self) -> Mapping[str, SlotValue]:
        """Return the slots as a dictionary, for records."""
        return dict(self.slots)


PrimitiveKind = Literal[
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


class Primitive(NamedTuple):
    """The movement by which the oracle completes a stage.

    | kind | subject, place | movement |
    | --- | --- | --- |
    | ``pick_cube`` | cube or tape | grasp it and lift it |
    | ``place_on`` | cube or tape, target or site | put the held object there |
    | ``drop_into`` | cube, bin | let the held object fall in, and retreat |
    | ``put_into`` | tape, box | let go of the held object right above the rim, and up |
    | ``move_over`` | cube, target | carry the held object over the place |
    | ``put_down`` | cube or container | straight down, let go at the tool height `height`, up |
    | ``pick_container`` | container | grasp its knob and lift it |
    | ``press`` | button | above it, down and up with closed fingers |
    | ``press_below`` | button | from where the hand is; at `steps` since reset if it can |
    | ``hover`` | button | above it with closed fingers |
    | ``hold`` | ``"robot"`` | stay for `steps` with an open gripper |
    | ``hold_until`` | ``"robot"`` | stay until `steps` since reset with closed fingers |
    | ``retreat`` | ``"robot"`` | away from the objects, then as ``hold`` |
    | ``go_home`` | ``"robot"`` | to the home position |

    Attributes:
        kind: the movement; `roboirg.simulation.expert.primitives` has its waypoints.
        subject: name of the object to handle, or ``"robot"``.
        place: name of the object where it goes.
        steps: duration or time, in control steps.
        height: of the tool where it lets go, m, for ``put_down``.
    """

    kind: PrimitiveKind
    subject: str
    place: str | None = None
    steps: int = 0
    height: float = 0.07


ROBOT = "robot"
"""Subject of a primitive that handles no object."""
PICKS = frozenset({"pick_cube", "pick_container"})
"""Primitives that take their subject into the hand."""
HANDLES_HELD = frozenset({"place_on", "put_down", "drop_into", "put_into", "move_over"})
"""Primitives whose subject is in the hand: to repeat one, the pick is repeated first."""


@dataclass(frozen=True, slots=True)
class Stage:
    """One step of the plan: what must happen next, what must not, and the oracle's movement.

    Attributes:
        expects: the condition that completes the stage.
        primitive: the oracle's movement.
        subgoal: simple subgoal in words, lower case; ``{at}`` marks where the grounded form
            puts ``at <y, x>``.
        forbids: facts and rules any of which fails the episode while this stage is current.
        points_at: the object whose pixel the grounded form names; None if it has no slot.
        lasting: control steps for which `expects` has to hold before the stage is complete.
        timer: name of the timer that the stage's first evaluation starts, unless it runs already.
        in_video: whether the video shows the stage, if it is part of the demonstration.
    """

    expects: Condition
    primitive: Primitive
    subgoal: str
    forbids: tuple[Fact | Rule, ...] = ()
    points_at: str | None = None
    lasting: int = 0
    timer: str | None = None
    in_video: bool = True

    def forbidding(self, *forbidden: Fact | Rule) -> Stage:
        """Return a copy of the stage in which these facts and rules fail the episode as well."""
        return replace(self, forbids=(*self.forbids, *forbidden))


def episode_key(task: str, split: Split, index: int) -> str:
    """Return the name of an episode, for example ``"PickXtimes/test/3"``."""
    return f"{task}/{split}/{index}"


@dataclass(frozen=True, slots=True)
class Episode:
    """One episode: its seed and everything that follows from it.

    Attributes:
        task: name of the task.
        split: the split it belongs to.
        index: 0-based position in the split.
        seed: RoboMME's, or that of the scene sampler.
        difficulty: of the scene.
        scene: objects at the start and their scripted movements.
        goal: the meaning of the instruction.
        stages: what the policy must do, in order.
        demonstration: stages that the oracle plays before the policy's turn; may be empty.
        recorded: whether the demonstration replays RoboMME's recorded actions; otherwise the
            oracle plans it.
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
    recorded: bool = False

    @property
    def key(self) -> str:
        """The episode's short unique name."""
        return episode_key(self.task, self.split, self.index)
