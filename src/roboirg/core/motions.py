"""Scripted movements of objects, independent of the robot: plain data that the world plays.

Steps are control steps before the physics of a step, counted since reset or since a stage of the
demonstration began. Source of all rules and figures: RoboMME.
"""

from __future__ import annotations

from typing import NamedTuple

from roboirg.core.conditions import Fact


class Point(NamedTuple):
    """A position in the world frame, meters."""

    x: float
    y: float
    z: float


class Away(NamedTuple):
    """An object leaves the world for a while, then returns at once.

    Attributes:
        subject: name of the object.
        start: first step at which it is away.
        end: the step at which it returns: to its place in the scene, or to the position (xy) that
            `under` has then, with its own height and yaw.
        under: name of the object whose place it takes; None for its own.
    """

    subject: str
    start: int
    end: int
    under: str | None = None


class Swap(NamedTuple):
    """Two objects change places and orientations, passing each other on opposite sides.

    With a = 0 to 1 over the steps and w = a^2 (3 - 2 a), each goes the share w of the straight line
    between the two and `lane` sin(pi w) to the side. Heights do not change.

    Attributes:
        first: name of an object.
        second: name of the other.
        start: the step at which the positions are read, since reset or since `stage` began.
        steps: duration; the movement lasts from `start` to `start + steps`, both included.
        lane: sideways swing, m.
        pinned: names of objects that are held in place meanwhile.
        stage: index of the demonstration's stage from whose first step `start` counts; None
            counts from reset.
    """

    first: str
    second: str
    start: int
    steps: int
    lane: float
    pinned: tuple[str, ...] = ()
    stage: int | None = None


class Shuttle(NamedTuple):
    """An object moves back and forth on a straight line, slower near the ends.

    In a pass with tau = 0 to 1 it is at begin + (3 tau^2 - 2 tau^3) (end - begin).

    Attributes:
        subject: name of the object.
        begin: where the first pass starts.
        end: where the first pass ends.
        interval: steps of one pass.
        passes: number of passes, in alternate directions; afterwards it rests.
        stopped_by: the fact that stops it for good.
    """

    subject: str
    begin: Point
    end: Point
    interval: int
    passes: int
    stopped_by: Fact


class Glow(NamedTuple):
    """An object is visible while a fact holds, and a little longer.

    Attributes:
        subject: name of the object; it appears at its place in the scene.
        during: the fact.
        linger: control steps for which it stays visible afterwards.
    """

    subject: str
    during: Fact
    linger: int


class Vanish(NamedTuple):
    """An object leaves the world for good once a fact holds."""

    subject: str
    when: Fact


Motion = Away | Swap | Shuttle | Glow | Vanish
