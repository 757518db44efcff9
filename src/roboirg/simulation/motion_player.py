"""Scripted motions of a scene: objects hide, swap, move back and forth, glow or vanish."""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections.abc import Iterable, Mapping, Sequence
from collections.abc import Set as AbstractSet
from typing import Any, Generic, NamedTuple, TypeVar

import numpy as np
import sapien
from numpy.typing import NDArray

from roboirg.core.conditions import Fact
from roboirg.core.motions import Away, Glow, Motion, Point, Shuttle, Swap, Vanish
from roboirg.simulation.bodies import Body

Bodies = Mapping[str, Body]
M = TypeVar("M", bound=Motion)

_PARKING = Point(10.0, 10.0, 10.0)
"""Where the first object is kept while it is out of the world, far from everything."""
_SPACING = 0.5
"""Meters between the places of absent objects, so that they do not touch."""


class MotionContext(NamedTuple):
    """Inputs of a motion before the physics of a control step.

    Attributes:
        step: control steps since reset.
        facts: all facts that held after the last step.
        stages: step at which each stage became due, by stage index.
    """

    step: int
    facts: AbstractSet[Fact]
    stages: Mapping[int, int]


class MotionPlayer:
    """Plays all scripted motions of a scene; call its methods in every control step.

    Args:
        motions: of the scene.
        bodies: all objects of the scene, by name.
    """

    def __init__(self, motions: Sequence[Motion], bodies: Bodies) -> None:
        players: list[_ScriptedMotion[Any]] = []
        for number, motion in enumerate(motions):
            parking = _PARKING._replace(x=_PARKING.x + _SPACING * number)
            player = _PLAYERS[type(motion)]
            players.append(player(motion, bodies, parking))
        self._players = sorted(players, key=_turn)

    def before_step(self, context: MotionContext) -> None:
        """Move the objects for the next control step."""
        for player in self._players:
            player.before_step(context)

    def after_step(self, facts: AbstractSet[Fact]) -> None:
        """Remove the objects that the new facts make vanish."""
        for player in self._players:
            player.after_step(facts)

    def absent(self) -> frozenset[str]:
        """Return the names of objects that were out of the world in the last control step."""
        return frozenset(player.subject for player in self._players if player.absent)

    def stopped(self) -> frozenset[str]:
        """Return the names of objects that have stopped permanently."""
        return frozenset(player.subject for player in self._players if player.stopped)


class _ScriptedMotion(ABC, Generic[M]):
    """Plays one motion of one object.

    Args:
        motion: what is played.
        bodies: all objects of the scene, by name.
        parking: where the object is while it is out of the world.

    Attributes:
        subject: name of the object.
        absent: whether the object was out of the world in the last control step.
        stopped: whether the object has stopped permanently.
    """

    absent = False
    stopped = False

    def __init__(self, motion: M, bodies: Bodies, parking: Point) -> None:
        self._motion = motion
        self._bodies = bodies
        self._parking = parking
        self.subject = motion.first if isinstance(motion, Swap) else motion.subject
        self._body = bodies[self.subject]

    @abstractmethod
    def before_step(self, context: MotionContext) -> None:
        """Move the object for the next control step."""

    def after_step(self, facts: AbstractSet[Fact]) -> None:
        """Take note of the facts after the step; most motions need none."""


class _AwayMotion(_ScriptedMotion[Away]):
    """Takes an object out of the world for a while; it may return under another one."""

    def __init__(self, motion: Away, bodies: Bodies, parking: Point) -> None:
        super().__init__(motion, bodies, parking)
        self.absent = motion.start == 0

    def before_step(self, context: MotionContext) -> None:
        self.absent = self._motion.start <= context.step < self._motion.end
        if self.absent:
            self._body.put(self._parking)
        elif context.step == self._motion.end:
            place = self._body.item.position
            if self._motion.under is not None:
                x, y, _ = self._bodies[self._motion.under].position
                place = place._replace(x=x, y=y)
            self._body.put(place)


class _SwapMotion(_ScriptedMotion[Swap]):
    """Exchanges two objects on curved lanes, while others (pinned) are held in place."""

    # The poses when the motion began: of the two that swap, and of those that are held in place.
    _first_start: sapien.Pose
    _second_start: sapien.Pose
    _pinned_starts: list[sapien.Pose]

    def __init__(self, motion: Swap, bodies: Bodies, parking: Point) -> None:
        super().__init__(motion, bodies, parking)
        self._second = bodies[motion.second]
        self._pinned = [bodies[name] for name in motion.pinned]

    def before_step(self, context: MotionContext) -> None:
        motion = self._motion
        begin = 0 if motion.stage is None else context.stages.get(motion.stage)
        if begin is None:
            return
        elapsed = context.step - begin - motion.start
        if not 0 <= elapsed <= motion.steps:
            return
        if elapsed == 0:
            self._first_start = self._body.entity.pose
            self._second_start = self._second.entity.pose
            self._pinned_starts = [body.entity.pose for body in self._pinned]
        share = elapsed / motion.steps
        first = _pose_on_lane(self._first_start, self._second_start, share, motion.lane)
        second = _pose_on_lane(self._second_start, self._first_start, share, motion.lane)
        self._body.set_pose(first)
        self._second.set_pose(second)
        for body, pose in zip(self._pinned, self._pinned_starts, strict=True):
            body.set_pose(pose)


class _ShuttleMotion(_ScriptedMotion[Shuttle]):
    """Moves an object back and forth until a fact, such as a pressed button, stops it for good."""

    def before_step(self, context: MotionContext) -> None:
        if self.stopped:
            return
        self._body.put(shuttle_position(self._motion, context.step))
        self.stopped = self._motion.stopped_by in context.facts


class _GlowMotion(_ScriptedMotion[Glow]):
    """Shows a marker while a fact holds, and for some steps after it."""

    absent = True
    _lit_at: int | None = None
    """The last step with the fact that it glows during; None before the first."""

    def before_step(self, context: MotionContext) -> None:
        if self._motion.during in context.facts:
            self._lit_at = context.step
        self.absent = self._lit_at is None or context.step - self._lit_at > self._motion.linger
        self._body.put(self._parking if self.absent else self._body.item.position)


class _VanishMotion(_ScriptedMotion[Vanish]):
    """Takes an object out of the world for good once a fact holds."""

    def before_step(self, context: MotionContext) -> None:
        del context
        if self.absent:
            self._body.put(self._parking)

    def after_step(self, facts: AbstractSet[Fact]) -> None:
        if not self.absent and self._motion.when in facts:
            self.absent = True
            self._body.put(self._parking)


def _turn(player: _ScriptedMotion[Any]) -> int:
    """Return the sort key by which swaps move first in a step.

    An object that returns under another needs the position that this one has then.
    """
    return 0 if isinstance(player, _SwapMotion) else 1


_PLAYERS: Mapping[type[Motion], type[_ScriptedMotion[Any]]] = {
    Away: _AwayMotion,
    Swap: _SwapMotion,
    Shuttle: _ShuttleMotion,
    Glow: _GlowMotion,
    Vanish: _VanishMotion,
}
"""What plays each kind of motion."""


def shuttle_position(motion: Shuttle, step: int) -> Point:
    """Return the position of an unstopped shuttle at a control step.

    It goes from the motion's begin to its end, back again, and so on, `passes` times in all, each
    in `interval` steps. After the last it stays where it is.
    """
    passes_done = min(step / motion.interval, float(motion.passes))
    complete_passes = min(int(passes_done), motion.passes - 1)
    share = _smooth(passes_done - complete_passes)
    if complete_passes % 2 == 0:
        return Point(*_between(motion.begin, motion.end, share))
    return Point(*_between(motion.end, motion.begin, share))


def _pose_on_lane(start: sapien.Pose, goal: sapien.Pose, share: float, lane: float) -> sapien.Pose:
    """Return the pose on a curve from one pose to another, at the height of the first.

    Two objects that swap take curves on opposite sides of the line between them.

    Args:
        start: pose at share 0.
        goal: pose at share 1; elsewhere in the plane.
        share: of the motion's time that has passed, 0 to 1 or more.
        lane: distance of the curve's middle from the straight line, to its left, m.
    """
    height = start.p[2]
    if share >= 1.0:
        x, y, _ = goal.p
        return sapien.Pose([x, y, height], goal.q)
    smooth = _smooth(share)
    x, y, _ = _between(start.p, goal.p, smooth)
    dx = float(goal.p[0] - start.p[0])
    dy = float(goal.p[1] - start.p[1])
    # (-dy, dx) points to the left of the line, and is as long as it.
    swing = lane * math.sin(math.pi * smooth) / math.hypot(dx, dy)
    return sapien.Pose([x - dy * swing, y + dx * swing, height], _turned(start, goal, smooth))


def _turned(start: sapien.Pose, goal: sapien.Pose, share: float) -> NDArray[np.float32]:
    """Return the quaternion (w, x, y, z) that has turned by a share from one pose to another."""
    begin = np.asarray(start.q)
    end = np.asarray(goal.q)
    # Quaternions q and -q are the same rotation; the nearer one gives the shorter turn.
    if float(np.dot(begin, end)) < 0.0:
        end = -end
    turned = begin + share * (end - begin)
    return np.asarray(turned / np.linalg.norm(turned))


def _between(begin: Iterable[float], end: Iterable[float], share: float) -> tuple[float, ...]:
    """Return the point that divides the line between two points by a share."""
    return tuple(float(a) + share * (float(b) - float(a)) for a, b in zip(begin, end, strict=True))


def _smooth(share: float) -> float:
    """Map a share of time, 0 to 1, to one of the way, with zero speed at both ends: 0.5 → 0.5."""
    return share * share * (3.0 - 2.0 * share)
