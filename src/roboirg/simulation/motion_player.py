"""Scripted motions of a scene: objects hide, swap, move back and forth, glow or vanish."""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections.abc import Iterable, Mapping, Sequence
from collections.abc import Set as AbstractSet
from typing import Any, Generic, NamedTuple, TypeVar

import numpy as np
import sapien

from roboirg.core.conditions import Fact
from roboirg.core.motions import Away, Glow, Motion, Point, Shuttle, Swap, Vanish
from roboirg.simulation.bodies import Body

Bodies = Mapping[str, Body]
M = TypeVar("M", bound=Motion)

_SPACING = 0.5
"""Meters between the parking spots of absent objects, so that they do not touch."""


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
    """Plays all motions of a scene."""

    def __init__(self, motions: Sequence[Motion], bodies: Bodies) -> None:
        spots = (Point(10.0 + _SPACING * index, 10.0, 10.0) for index in range(len(motions)))
        players = [
            _PLAYERS[type(motion)](motion, bodies, spot)
            for motion, spot in zip(motions, spots, strict=True)
        ]
        # Swaps come first: an object that returns under another needs that one's new position.
        self._players = sorted(players, key=lambda player: not isinstance(player, _SwapMotion))

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
        spot: where the object is while it is out of the world.

    Attributes:
        subject: name of the object.
        absent: whether the object was out of the world in the last control step.
        stopped: whether the object has stopped permanently.
    """

    absent = False
    stopped = False

    def __init__(self, motion: M, bodies: Bodies, spot: Point) -> None:
        self._motion, self._bodies, self._spot = motion, bodies, spot
        self.subject = motion.first if isinstance(motion, Swap) else motion.subject
        self._body = bodies[self.subject]

    @abstractmethod
    def before_step(self, context: MotionContext) -> None: ...

    def after_step(self, facts: AbstractSet[Fact]) -> None:
        del facts


class _AwayMotion(_ScriptedMotion[Away]):
    def __init__(self, motion: Away, bodies: Bodies, spot: Point) -> None:
        super().__init__(motion, bodies, spot)
        self.absent = motion.start == 0

    def before_step(self, context: MotionContext) -> None:
        self.absent = self._motion.start <= context.step < self._motion.end
        if self.absent:
            self._body.put(self._spot)
        elif context.step == self._motion.end:
            place = self._body.item.position
            if self._motion.under is not None:
                x, y, _ = self._bodies[self._motion.under].position
                place = place._replace(x=x, y=y)
            self._body.put(place)


class _SwapMotion(_ScriptedMotion[Swap]):
    def __init__(self, motion: Swap, bodies: Bodies, spot: Point) -> None:
        super().__init__(motion, bodies, spot)
        names = (motion.first, motion.second, *motion.pinned)
        self._moved = [bodies[name] for name in names]
        self._poses: list[sapien.Pose] = []

    def before_step(self, context: MotionContext) -> None:
        begin = 0 if self._motion.stage is None else context.stages.get(self._motion.stage)
        if begin is None:
            return
        elapsed = context.step - begin - self._motion.start
        if not 0 <= elapsed <= self._motion.steps:
            return
        if elapsed == 0:
            self._poses = [body.entity.pose for body in self._moved]
        first, second = self._poses[:2]
        share = elapsed / self._motion.steps
        poses = (
            _on_lane(first, second, share, self._motion.lane),
            _on_lane(second, first, share, self._motion.lane),
            *self._poses[2:],
        )
        for body, pose in zip(self._moved, poses, strict=True):
            body.set_pose(pose)


class _ShuttleMotion(_ScriptedMotion[Shuttle]):
    def before_step(self, context: MotionContext) -> None:
        if self.stopped:
            return
        self._body.put(shuttle_position(self._motion, context.step))
        self.stopped = self._motion.stopped_by in context.facts


class _GlowMotion(_ScriptedMotion[Glow]):
    absent = True
    _last: int | None = None

    def before_step(self, context: MotionContext) -> None:
        if self._motion.during in context.facts:
            self._last = context.step
        self.absent = self._last is None or context.step - self._last > self._motion.linger
        self._body.put(self._spot if self.absent else self._body.item.position)


class _VanishMotion(_ScriptedMotion[Vanish]):
    def before_step(self, context: MotionContext) -> None:
        del context
        if self.absent:
            self._body.put(self._spot)

    def after_step(self, facts: AbstractSet[Fact]) -> None:
        if not self.absent and self._motion.when in facts:
            self.absent = True
            self._body.put(self._spot)


_PLAYERS: Mapping[type[Motion], type[_ScriptedMotion[Any]]] = {
    Away: _AwayMotion,
    Swap: _SwapMotion,
    Shuttle: _ShuttleMotion,
    Glow: _GlowMotion,
    Vanish: _VanishMotion,
}
"""What plays each kind of motion."""


def shuttle_position(motion: Shuttle, step: int) -> Point:
    """Return the position of an unstopped shuttle at a control step."""
    done = min(step / motion.interval, float(motion.passes))
    number = min(int(done), motion.passes - 1)
    share = _smooth(done - number)
    begin, end = (motion.begin, motion.end) if number % 2 == 0 else (motion.end, motion.begin)
    return Point(*_between(begin, end, share))


def _on_lane(start: sapien.Pose, goal: sapien.Pose, share: float, lane: float) -> sapien.Pose:
    """Return the pose on a curve from one place to another, left of the straight line."""
    if share >= 1.0:
        x, y, _ = goal.p
        return sapien.Pose([x, y, start.p[2]], goal.q)
    smooth = _smooth(share)
    x, y, _ = _between(start.p, goal.p, smooth)
    dx, dy = float(goal.p[0] - start.p[0]), float(goal.p[1] - start.p[1])
    swing = lane * math.sin(math.pi * smooth) / math.hypot(dx, dy)
    # Quaternions q and -q are the same rotation; the nearer one gives the shorter turn.
    sign = 1.0 if float(np.dot(start.q, goal.q)) >= 0.0 else -1.0
    turned = np.asarray(start.q) + smooth * (sign * np.asarray(goal.q) - np.asarray(start.q))
    turned /= np.linalg.norm(turned)
    return sapien.Pose([x - dy * swing, y + dx * swing, start.p[2]], turned)


def _between(begin: Iterable[float], end: Iterable[float], share: float) -> tuple[float, ...]:
    return tuple(float(a) + share * (float(b) - float(a)) for a, b in zip(begin, end, strict=True))


def _smooth(share: float) -> float:
    """Ease in and out: map 0..1 to 0..1 with zero speed at both ends."""
    return share * share * (3.0 - 2.0 * share)
