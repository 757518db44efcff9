"""What each kind of fact means: the one table that judging, detection and display read.

Another package adds a kind with `register_fact_kind`, in the module of the task that uses it:

    register_fact_kind("upright", FactTraits(..., detect=detect_upright))

Thresholds are in meters, radians and seconds (RoboMME, evaluation mode). ``reached`` and ``held``
are our own: no stage expects them, they show how something failed. So are the kinds with the role
`FactRole.ATTEMPT`, which form a list of their own.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from enum import StrEnum
from types import MappingProxyType
from typing import Any, Literal

from roboirg.core.errors import InvalidValueError

FactKind = str
"""A key of `FACT_TRAITS`."""

Detector = Callable[[Any], Iterable[tuple[FactKind, str, str | None]]]
"""Returns the facts of a kind (kind, subject and place) that hold now, given a
`roboirg.simulation.fact_detection.DetectionContext`."""


class FactRole(StrEnum):
    """What a fact says about the hand and its object."""

    APPROACH = "approach"
    """The hand is above a place."""
    TOUCH = "touch"
    """The hand is at an object."""
    GRIP = "grip"
    """The fingers hold an object, at any height."""
    RAISE = "raise"
    """An object is in the hand and up."""
    CARRY = "carry"
    """An object is above a place."""
    RELEASE = "release"
    """An object rests anywhere, released."""
    PLACING = "placing"
    """An object rests at a place, released."""
    PRESS = "press"
    """A button is down. It often ends a task."""
    STATE = "state"
    """No act: how the robot or the world is."""
    ATTEMPT = "attempt"
    """What the hand tried or where it was: for attribution alone, never among a world's facts."""


@dataclass(frozen=True, slots=True)
class FactTraits:
    """The meaning of one kind of fact.

    Attributes:
        role: what it says about the hand and its object.
        subjects: kinds of object it can be about, or ``"robot"``.
        places: kinds of object its place can be; empty if it has no place.
        holds_while: its definition.
        past: the act in the past tense, for causes: ``"placed {subject} on {place}"``.
        state: words between subject and place, for lists of facts: ``"placed on"``.
        ceased: what happened when it no longer holds, in the past tense; empty if no list shows it.
        lasts: whether it never ceases to hold.
        undone_by_release: whether letting the object go takes the act back. Looking under a
            container cannot be taken back.
        timeline: what a timeline shows of it: nothing, its start, or start and end.
        detect: finds the facts of this kind; None for the kinds of this package, which
            `roboirg.simulation.fact_detection` finds.
    """

    role: FactRole
    subjects: tuple[str, ...]
    holds_while: str
    past: str
    state: str
    places: tuple[str, ...] = ()
    ceased: str = ""
    lasts: bool = False
    undone_by_release: bool = True
    timeline: Literal["nothing", "start", "both"] = "start"
    detect: Detector | None = None

    @property
    def grips(self) -> bool:
        """Whether the object is in the hand."""
        return self.role in (FactRole.GRIP, FactRole.RAISE)


_MOVABLE = ("cube", "tape")
_GRASPABLE = (*_MOVABLE, "container")

_TRAITS: dict[FactKind, FactTraits] = {
    "picked": FactTraits(
        role=FactRole.RAISE,
        subjects=_MOVABLE,
        holds_while="it is above z 0.05 and grasped",
        past="picked up {subject}",
        state="picked",
        ceased="lowered {subject} or let it go",
        timeline="both",
    ),
    "lying": FactTraits(
        role=FactRole.RELEASE,
        subjects=_MOVABLE,
        holds_while="it lies released, z <= 0.035",
        past="let go of {subject}",
        state="lying",
        timeline="nothing",
    ),
    "placed": FactTraits(
        role=FactRole.PLACING,
        subjects=_MOVABLE,
        places=("target", "site"),
        holds_while="it lies released within 0.05 (xy) of the place",
        past="placed {subject} on {place}",
        state="placed on",
        ceased="took {subject} off {place}",
        timeline="both",
    ),
    "over": FactTraits(
        role=FactRole.CARRY,
        subjects=_MOVABLE,
        places=("target",),
        holds_while="it came within 0.03 (xy) below z 0.12, until beyond 0.04 or z 0.3",
        past="moved {subject} over {place}",
        state="over",
    ),
    "binned": FactTraits(
        role=FactRole.PLACING,
        subjects=_MOVABLE,
        places=("bin", "box"),
        holds_while="from the step on at which it has fallen in: released within 0.05 (xy), "
        "z <= 0.035, fingers more than 0.02 open, the hand more than 0.02 away",
        past="put {subject} into {place}",
        state="in",
        lasts=True,
    ),
    "lifted": FactTraits(
        role=FactRole.RAISE,
        subjects=("container",),
        holds_while="its origin is above z 0.15",
        past="lifted {subject}",
        state="lifted",
        ceased="lowered {subject}",
        undone_by_release=False,
        timeline="both",
    ),
    "put_down": FactTraits(
        role=FactRole.RELEASE,
        subjects=("container",),
        holds_while="its origin is at z <= 0.07, released, the hand above z 0.05",
        past="put {subject} down",
        state="put down",
    ),
    "reached": FactTraits(
        role=FactRole.TOUCH,
        subjects=_GRASPABLE,
        holds_while="the tool center is within 0.03 of its origin",
        past="reached {subject}",
        state="reached",
    ),
    "held": FactTraits(
        role=FactRole.GRIP,
        subjects=_GRASPABLE,
        holds_while="both fingers grasp it, at any height",
        past="took hold of {subject}",
        state="held",
        timeline="nothing",
    ),
    "pressed": FactTraits(
        role=FactRole.PRESS,
        subjects=("button",),
        holds_while="its cap is more than 0.005 down",
        past="pressed {subject}",
        state="pressed",
    ),
    "hovering": FactTraits(
        role=FactRole.APPROACH,
        subjects=("robot",),
        places=("button",),
        holds_while="the hand is within 0.03 (xy) of the button and below z 0.2",
        past="moved above {place}",
        state="over",
    ),
    "near": FactTraits(
        role=FactRole.STATE,
        subjects=("shuttle",),
        places=("target",),
        holds_while="its center is within 0.06 (xy) of the target's",
        past="let {subject} come near {place}",
        state="near",
    ),
    "stopped": FactTraits(
        role=FactRole.STATE,
        subjects=("shuttle",),
        places=("target",),
        holds_while="it has been stopped for good and is near",
        past="stopped {subject} on {place}",
        state="stopped on",
    ),
    "still": FactTraits(
        role=FactRole.STATE,
        subjects=("robot",),
        holds_while="no arm joint moves faster than 0.2 rad/s",
        past="came to rest",
        state="still",
        timeline="nothing",
    ),
    "home": FactTraits(
        role=FactRole.STATE,
        subjects=("robot",),
        holds_while="all nine joints are within 0.01 of the home position",
        past="went home",
        state="home",
        timeline="nothing",
    ),
    "above": FactTraits(
        role=FactRole.ATTEMPT,
        subjects=("robot",),
        places=_GRASPABLE,
        holds_while="the hand is below z 0.25 and within 0.05 (xy) of its outline",
        past="moved above {place}",
        state="above",
        timeline="nothing",
    ),
    "clutched": FactTraits(
        role=FactRole.ATTEMPT,
        subjects=_GRASPABLE,
        holds_while="at the step at which the fingers have closed on nothing, if it was nearest "
        "when they were open, within 0.05 (xy) of its outline and 0.08 above its origin; another "
        "one too that was less than 0.015 farther",
        past="closed its fingers next to {subject}",
        state="missed",
    ),
    "pushed": FactTraits(
        role=FactRole.ATTEMPT,
        subjects=_GRASPABLE,
        holds_while="it is not held and has moved by more than 0.025 (xy) since the hand came to "
        "it: within 0.04 (xy) of its outline and no more than 0.02 above its origin",
        past="pushed {subject}",
        state="pushed",
    ),
    "emptied": FactTraits(
        role=FactRole.ATTEMPT,
        subjects=("robot",),
        places=("target", "bin", "box", "cube"),
        holds_while="of a target: the hand is below z 0.1 and within 0.05 (xy) of its outline, and "
        "next to no movable object; else at the step at which closed fingers that held nothing and "
        "were above z 0.1 open next to it, below z 0.1 or at any height at a bin or box",
        past="opened an empty hand at {place}",
        state="emptied at",
    ),
    "beside": FactTraits(
        role=FactRole.ATTEMPT,
        subjects=_MOVABLE,
        places=("target", "bin", "box"),
        holds_while="it is held within 0.05 (xy) of the outline of the place",
        past="carried {subject} to {place}",
        state="carried to",
        timeline="nothing",
    ),
    "lowered": FactTraits(
        role=FactRole.ATTEMPT,
        subjects=_GRASPABLE,
        holds_while="it is held, and the tool center is below z 0.08",
        past="lowered {subject}",
        state="lowered",
        timeline="nothing",
    ),
    "pressed_beside": FactTraits(
        role=FactRole.ATTEMPT,
        subjects=("button",),
        holds_while="it is not pressed, and closed fingers that were above z 0.1 are below z 0.06 "
        "and within 0.05 (xy) of its outline",
        past="came down next to {subject}",
        state="missed",
    ),
    "lingering": FactTraits(
        role=FactRole.ATTEMPT,
        subjects=("robot",),
        holds_while="the hand has stayed within 0.05 of a point for 60 steps",
        past="stayed where it was",
        state="lingering",
        timeline="nothing",
    ),
}

FACT_TRAITS: Mapping[FactKind, FactTraits] = MappingProxyType(_TRAITS)
"""Every kind of fact, those of other packages included."""


def register_fact_kind(kind: FactKind, traits: FactTraits) -> None:
    """Add a kind of fact, which `fact_traits` then knows; adding the same one twice does no harm.

    Raises:
        InvalidValueError: the kind exists with other traits.
    """
    if _TRAITS.setdefault(kind, traits) != traits:
        raise InvalidValueError(
            f"There is already a kind of fact {kind!r} with other traits; choose another name."
        )


def fact_traits(kind: FactKind) -> FactTraits:
    """Return the traits of a kind of fact: what it means, and how it is said and shown.

    A kind that is not registered, as in a record of a task that is not installed, is a state called
    by its name: ``"upside_down"`` -> *upside down cube_red*.
    """
    traits = FACT_TRAITS.get(kind)
    if traits is not None:
        return traits
    words = kind.replace("_", " ")
    # `past` is a pattern, in which braces of a stranger's record would name fields.
    pattern = words.replace("{", "{{").replace("}", "}}")
    return FactTraits(
        role=FactRole.STATE, subjects=(), holds_while="", past=f"{pattern} {{subject}}", state=words
    )


def raised_kind(object_kind: str) -> FactKind | None:
    """Return the kind of fact that says that an object of a kind is in the hand and up.

    ``"cube"`` -> ``"picked"``, ``"container"`` -> ``"lifted"``, ``"button"`` -> None.
    """
    for kind, traits in FACT_TRAITS.items():
        if traits.role is FactRole.RAISE and object_kind in traits.subjects:
            return kind
    return None
