"""Plays the scripted motions of a scene: objects that hide, change places, run, glow or vanish."""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections.abc import Iterable, Mapping, Sequence
from collections.abc import Set as AbstractSet
from typing import NamedTuple, assert_never

import numpy as np
import sapien

from roboirg.core.conditions import Fact
from roboirg.core.motions import Away, Glow, Motion, Point, Shuttle, Swap, Vanish
from roboirg.simulation.bodies import Body

Bodies = Mapping[str, Body]

_SPACING = 0.5
"""Meters between the spots of objects that are away, so that they do not touch."""


class MotionContext(NamedTuple):
    """What a motion may depend on, before the physics of a control step.

    Attributes:
        step: control steps since reset.
        facts: all that held at the last evaluation.
        stages: for each stage that has become due: at which step.
    """

    step: int
    facts: AbstractSet[Fact]
    stages: Mapping[int, int]


class MotionPlayer:
    """Plays all motions of a scene.

    Args:
        motions: what is to be played.
        bodies: the scene's objects by name.
    """

    def __init__(self, motions: Sequence[Motion], bodies: Bodies) -> None:
        spots = (Point(10.0 + _SPACING * index, 10.0, 10.0) for index in range(len(motions)))
        players = [
            _player(motion, bodies, spot) for motion, spot in zip(motions, spots, strict=True)
        ]
        # What comes back to another object's place has to find it there.
        self._players = sorted(players, key=lambda player: not isinstance(player, _SwapPlayer))

    def before_step(self, moment: MotionContext) -> None:
        """Put the objects where they have to be for the coming control step."""
        for player in self._players:
            player.before_step(moment)

    def after_step(self, facts: AbstractSet[Fact]) -> None:
        """Take away what the new facts make vanish."""
        for player in self._players:
            player.after_step(facts)

    def absent(self) -> frozenset[str]:
        """Names of the objects that were out of the world in the last control step."""
        return frozenset(player.subject for player in self._players if player.absent)

    def stopped(self) -> frozenset[str]:
        """Names of the objects that have been stopped for good."""
        return frozenset(player.subject for player in self._players if player.stopped)


class _Player(ABC):
    """Plays one motion.

    Attributes:
        subject: name of the object.
        absent: whether it was out of the world in the last control step.
        stopped: whether something has stopped it for good.
    """

    def __init__(self, subject: str) -> None:
        self.subject = subject
        self.absent = False
        self.stopped = False

    @abstractmethod
    def before_step(self, moment: MotionContext) -> None: ...

    def after_step(self, facts: AbstractSet[Fact]) -> None:
        del facts


class _AwayPlayer(_Player):
    def __init__(self, motion: Away, bodies: Bodies, spot: Point) -> None:
        super().__init__(motion.subject)
        self._motion, self._spot = motion, spot
        self._body = bodies[motion.subject]
        self._under = None if motion.under is None else bodies[motion.under]
        self.absent = motion.start == 0

    def before_step(self, moment: MotionContext) -> None:
        self.absent = self._motion.start <= moment.step < self._motion.end
        if self.absent:
            self._body.put(self._spot)
        elif moment.step == self._motion.end:
            place = self._body.item.position
            if self._under is not None:
                x, y, _ = self._under.position
                place = place._replace(x=x, y=y)
            self._body.put(place)


class _SwapPlayer(_Player):
    def __init__(self, motion: Swap, bodies: Bodies) -> None:
        super().__init__(motion.first)
        self._motion = motion
        names = (motion.first, motion.second, *motion.pinned)
        self._bodies = [bodies[name] for name in names]
        self._poses: list[sapien.Pose] = []

    def before_step(self, moment: MotionContext) -> None:
        begin = 0 if self._motion.stage is None else moment.stages.get(self._motion.stage)
        if begin is None:
            return
        gone = moment.step - begin - self._motion.start
        if not 0 <= gone <= self._motion.steps:
            return
        if gone == 0:
            self._poses = [body.entity.pose for body in self._bodies]
        first, second = self._poses[:2]
        share = gone / self._motion.steps
        poses = (
            _on_lane(first, second, share, self._motion.lane),
            _on_lane(second, first, share, self._motion.lane),
            *self._poses[2:],
        )
        for body, pose in zip(self._bodies, poses, strict=True):
            body.set_pose(pose)


class _ShuttlePlayer(_Player):
    def __init__(self, motion: Shuttle, bodies: Bodies) -> None:
        super().__init__(motion.subject)
        self._motion, self._body = motion, bodies[motion.subject]

    def before_step(self, moment: MotionContext) -> None:
        if self.stopped:
            return
        self._body.put(shuttle_position(self._motion, moment.step))
        self.stopped = self._motion.stopped_by in moment.facts


class _GlowPlayer(_Player):
    def __init__(self, motion: Glow, bodies: Bodies, spot: Point) -> None:
        super().__init__(motion.subject)
        self._motion, self._body, self._spot = motion, bodies[motion.subject], spot
        self._last: int | None = None
        self.absent = True

    def before_step(self, moment: MotionContext) -> None:
        if self._motion.during in moment.facts:
            self._last = moment.step
        self.absent = self._last is None or moment.step - self._last > self._motion.linger
        self._body.put(self._spot if self.absent else self._body.item.position)


class _VanishPlayer(_Player):
    def __init__(self, motion: Vanish, bodies: Bodies, spot: Point) -> None:
        super().__init__(motion.subject)
        self._motion, self._body, self._spot = motion, bodies[motion.subject], spot

    def before_step(self, moment: MotionContext) -> None:
        del moment
        if self.absent:
            self._body.put(self._spot)

    def after_step(self, facts: AbstractSet[Fact]) -> None:
        if not self.absent and self._motion.when in facts:
            self.absent = True
            self._body.put(self._spot)


def _player(motion: Motion, bodies: Bodies, spot: Point) -> _Player:
    match motion:
        case Away():
            return _AwayPlayer(motion, bodies, spot)
        case Swap():
            return _SwapPlayer(motion, bodies)
        case Shuttle():
            return _ShuttlePlayer(motion, bodies)
        case Glow():
            return _GlowPlayer(motion, bodies, spot)
        case Vanish():
            return _VanishPlayer(motion, bodies, spot)
        case _:
            assert_never(motion)


def shuttle_position(motion: Shuttle, step: int) -> Point:
    """Where a shuttle that nothing stops is at a control step."""
    done = min(step / motion.interval, float(motion.passes))
    number = min(int(done), motion.passes - 1)
    share = _smooth(done - number)
    begin, end = (motion.begin, motion.end) if number % 2 == 0 else (motion.end, motion.begin)
    return Point(*_between(begin, end, share))


def _on_lane(start: sapien.Pose, goal: sapien.Pose, share: float, lane: float) -> sapien.Pose:
    """The pose on the way from one place to another, to the left of the straight line."""
    if share >= 1.0:
        x, y, _ = goal.p
        return sapien.Pose([x, y, start.p[2]], goal.q)
    smooth = _smooth(share)
    x, y, _ = _between(start.p, goal.p, smooth)
    dx, dy = float(goal.p[0] - start.p[0]), float(goal.p[1] - start.p[1])
    swing = lane * math.sin(math.pi * smooth) / math.hypot(dx, dy)
    # Quaternions q and -q are the same rotation; the nearer one makes the shorter turn.
    sign = 1.0 if float(np.dot(start.q, goal.q)) >= 0.0 else -1.0
    turned = np.asarray(start.q) + smooth * (sign * np.asarray(goal.q) - np.asarray(start.q))
    turned /= np.linalg.norm(turned)
    return sapien.Pose([x - dy * swing, y + dx * swing, start.p[2]], turned)


def _between(begin: Iterable[float], end: Iterable[float], share: float) -> tuple[float, ...]:
    return tuple(float(a) + share * (float(b) - float(a)) for a, b in zip(begin, end, strict=True))


def _smooth(share: float) -> float:
    """From 0 to 1 with rest at both ends."""
    return share * share * (3.0 - 2.0 * share)
