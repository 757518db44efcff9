"""Detect what the hand tries: facts that no stage expects, by which failures are attributed.

"Next to" an object is up to `BESIDE` from its outline, so a bigger body has a bigger surrounding.
What costs time waits for fingers that close or open, or for a low hand.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from collections.abc import Set as AbstractSet

from roboirg.core.conditions import Fact
from roboirg.core.episode import SceneObject
from roboirg.core.motions import Point
from roboirg.core.object_sizes import (
    BESIDE,
    FINGERS_OPEN,
    FINGERS_SHUT,
    HAND_HIGH,
    HAND_LOW,
    HAND_LOWERED,
    HAND_RAISED,
    LINGER_STEPS,
    UNCLEAR,
)
from roboirg.simulation.bodies import Body
from roboirg.simulation.panda import Panda


class AttemptDetector:
    """Detects the attempts in one world, step by step.

    Attributes:
        near: what the hand is near in this step: the object, the position of its origin, how far
            the tool center is from its outline in the plane, m, and whether the hand holds it. Each
            step begins without.
        found: the attempts of the last step.
    """

    def __init__(self, bodies: Mapping[str, Body], robot: Panda) -> None:
        self._robot, self._bodies = robot, tuple(bodies.values())
        self._peak, self._anchor, self._stays = 0.0, Point(0.0, 0.0, 0.0), 0
        self._gaps: dict[str, float] = {}
        self.near: list[tuple[SceneObject, Point, float, bool]] = []
        self._spots: Mapping[str, Point] = {}
        self.found: AbstractSet[Fact] = frozenset()

    def detect(self, tool: Point, facts: AbstractSet[Fact], spots: Mapping[str, Point]) -> None:
        """Find the attempts of this step.

        Args:
            tool: the tool center.
            facts: of the world.
            spots: positions of places by name, m.
        """
        self._spots = spots
        opening = float(self._robot.finger_positions.max())
        shut = opening < FINGERS_SHUT
        # The greatest height since the fingers closed on nothing; 0 while they have not.
        peak, self._peak = self._peak, max(self._peak, tool.z) if shut else 0.0
        stays = math.dist(tool, self._anchor) <= BESIDE
        self._anchor, self._stays = (self._anchor, self._stays + 1) if stays else (tool, 0)
        found = [Fact("lingering", "robot")] if self._stays >= LINGER_STEPS else []
        if tool.z <= HAND_HIGH:
            if opening > FINGERS_OPEN:  # closing fingers can push away what they mean
                self._gaps = {
                    item.name: gap
                    for item, position, gap, _ in self.near
                    if tool.z - position.z <= HAND_LOWERED
                }
            found += self._handled(tool, just_shut=shut and not peak)
            if peak > HAND_RAISED:
                found += self._ended(tool, facts, shut=shut)
        self.found = frozenset(found)
        self.near.clear()

    def _handled(self, tool: Point, *, just_shut: bool) -> Iterator[Fact]:
        """Yield what the hand is above, where it has carried something, and what it missed."""
        if tool.z <= HAND_RAISED and all(one[2] > BESIDE for one in self.near):
            yield from (Fact("emptied", "robot", one) for one in self._next_to(tool, "target"))
        most = min((*self._gaps.values(), BESIDE - UNCLEAR)) + UNCLEAR
        if just_shut:
            yield from (Fact("clutched", one) for one, gap in self._gaps.items() if gap <= most)
        for item, position, gap, held in self.near:
            name = item.name
            if gap <= BESIDE:
                yield Fact("above", "robot", name)
            if held and tool.z < HAND_LOWERED:
                yield Fact("lowered", name)
            places = ("target", "bin", "box") if held else ()
            yield from (Fact("beside", name, one) for one in self._next_to(position, *places))

    def _ended(self, tool: Point, facts: AbstractSet[Fact], *, shut: bool) -> Iterator[Fact]:
        """Yield where closed fingers that were up let go of nothing, or press nothing."""
        if not shut:
            kinds = ("bin", "box", "cube")[: 2 if tool.z > HAND_RAISED else None]
            yield from (Fact("emptied", "robot", one) for one in self._next_to(tool, *kinds))
        elif tool.z < HAND_LOW:
            missed = (Fact("pressed_beside", one) for one in self._next_to(tool, "button"))
            yield from (one for one in missed if Fact("pressed", one.subject) not in facts)

    def _next_to(self, point: Point, *kinds: str) -> list[str]:
        """Return the names of objects of some kinds to which a point is next."""
        return [
            body.item.name
            for body in self._bodies
            if body.item.kind in kinds
            and distance_in_plane(point, self._spots.get(body.item.name) or body.position)
            <= body.item.half_width + BESIDE
        ]


def distance_in_plane(first: Point, second: Point) -> float:
    """Return how far apart two points are in the plane, m."""
    return math.hypot(first.x - second.x, first.y - second.y)
