"""Detect what the hand tries: facts that no stage expects, by which failures are attributed.

Such a fact is an attempt, for example *clutched*: the fingers have closed on nothing next to an
object. `roboirg.core.fact_traits` defines each kind. "Next to" an object is up to `BESIDE` from its
outline, so a bigger body has a bigger surrounding. What costs time waits for fingers that close or
open, or for a low hand.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from collections.abc import Set as AbstractSet
from typing import NamedTuple

from roboirg.core.conditions import Fact
from roboirg.core.episode import SceneObject
from roboirg.core.motions import Point
from roboirg.core.object_sizes import (
    BESIDE,
    FINGERS_OPEN,
    FINGERS_SHUT,
    HAND_AT_SIDE,
    HAND_AT_TOP,
    HAND_HIGH,
    HAND_LOW,
    HAND_LOWERED,
    HAND_RAISED,
    LINGER_STEPS,
    PUSHED,
    UNCLEAR,
)
from roboirg.simulation.bodies import Body
from roboirg.simulation.panda import Panda


class NearObject(NamedTuple):
    """An object that the hand is near in one step.

    Attributes:
        item: its data.
        position: of its origin, m.
        gap: from its outline to the tool center in the plane, m; negative above the object.
        is_held: whether the hand holds it.
    """

    item: SceneObject
    position: Point
    gap: float
    is_held: bool


class AttemptDetector:
    """Detects the attempts in one world, step by step.

    Attributes:
        near: the objects that the hand is near in this step; each step begins without.
        found: the attempts of the last step.
    """

    def __init__(self, bodies: Mapping[str, Body], robot: Panda) -> None:
        self._robot = robot
        self._bodies = tuple(bodies.values())
        self.near: list[NearObject] = []
        self.found: AbstractSet[Fact] = frozenset()
        self._place_positions: Mapping[str, Point] = {}
        # The greatest height since the fingers closed on nothing, m; 0 while they have not.
        self._peak = 0.0
        # The gaps to the objects under the hand when the fingers were open last: closing fingers
        # can push away what they are meant to grasp.
        self._open_gaps: dict[str, float] = {}
        # Where the objects were to which the hand came, while it stays at them without a hold.
        self._came_to: dict[str, Point] = {}
        self._lingers_at = Point(0.0, 0.0, 0.0)
        self._lingering_steps = 0

    def detect(
        self, tool: Point, facts: AbstractSet[Fact], place_positions: Mapping[str, Point]
    ) -> None:
        """Find the attempts of this step.

        Args:
            tool: the tool center.
            facts: of the world.
            place_positions: of the objects that can be places, by name, m.
        """
        self._place_positions = place_positions
        opening = float(self._robot.finger_positions.max())
        is_shut = opening < FINGERS_SHUT
        peak = self._peak
        self._peak = max(peak, tool.z) if is_shut else 0.0

        found = []
        if self._lingers(tool):
            found.append(Fact("lingering", "robot"))
        if tool.z <= HAND_HIGH:
            if opening > FINGERS_OPEN:
                self._open_gaps = {
                    near.item.name: near.gap
                    for near in self.near
                    if tool.z - near.position.z <= HAND_LOWERED
                }
            if is_shut and not peak:
                found += self._missed_objects()
            found += self._hand_at_objects(tool)
            found += self._pushed_objects(tool)
            if peak > HAND_RAISED and is_shut:
                found += self._missed_buttons(tool, facts)
            if peak > HAND_RAISED and not is_shut:
                found += self._emptied_places(tool)
        self.found = frozenset(found)
        self.near.clear()

    def _lingers(self, tool: Point) -> bool:
        """Return whether the hand has been at about the same point for `LINGER_STEPS`."""
        if math.dist(tool, self._lingers_at) <= BESIDE:
            self._lingering_steps += 1
        else:
            self._lingers_at = tool
            self._lingering_steps = 0
        return self._lingering_steps >= LINGER_STEPS

    def _missed_objects(self) -> Iterator[Fact]:
        """Yield what fingers that have just closed on nothing may have been meant to grasp.

        It is the nearest object, and those that are not clearly farther away.
        """
        farthest = min((*self._open_gaps.values(), BESIDE - UNCLEAR)) + UNCLEAR
        for name, gap in self._open_gaps.items():
            if gap <= farthest:
                yield Fact("clutched", name)

    def _hand_at_objects(self, tool: Point) -> Iterator[Fact]:
        """Yield what the hand is above, what it lowers where, and targets that it visits empty."""
        if tool.z <= HAND_RAISED and all(near.gap > BESIDE for near in self.near):
            for target in self._next_to(tool, "target"):
                yield Fact("emptied", "robot", target)
        for item, position, gap, is_held in self.near:
            if gap <= BESIDE:
                yield Fact("above", "robot", item.name)
            if is_held and tool.z < HAND_LOWERED:
                yield Fact("lowered", item.name)
            if is_held:
                for place in self._next_to(position, "target", "bin", "box"):
                    yield Fact("beside", item.name, place)

    def _pushed_objects(self, tool: Point) -> Iterator[Fact]:
        """Yield what the hand has moved, without a hold on it, since it came to it."""
        came_to = {}
        for item, position, gap, is_held in self.near:
            is_at_hand = gap <= HAND_AT_SIDE and tool.z - position.z <= HAND_AT_TOP
            if is_held or not is_at_hand:
                continue
            first_position = self._came_to.get(item.name, position)
            came_to[item.name] = first_position
            if distance_in_plane(first_position, position) > PUSHED:
                yield Fact("pushed", item.name)
        self._came_to = came_to

    def _emptied_places(self, tool: Point) -> Iterator[Fact]:
        """Yield where fingers that were closed on nothing have opened, as if to let go."""
        kinds = ["bin", "box"]
        if tool.z <= HAND_RAISED:
            kinds.append("cube")
        for place in self._next_to(tool, *kinds):
            yield Fact("emptied", "robot", place)

    def _missed_buttons(self, tool: Point, facts: AbstractSet[Fact]) -> Iterator[Fact]:
        """Yield the buttons next to which closed fingers have come down without pressing them."""
        if tool.z >= HAND_LOW:
            return
        for button in self._next_to(tool, "button"):
            if Fact("pressed", button) not in facts:
                yield Fact("pressed_beside", button)

    def _next_to(self, point: Point, *kinds: str) -> Iterator[str]:
        """Yield the names of the objects of some kinds to which a point is next."""
        for body in self._bodies:
            if body.item.kind in kinds:
                center = self._place_positions.get(body.item.name) or body.position
                if distance_in_plane(point, center) <= body.item.half_width + BESIDE:
                    yield body.item.name


def distance_in_plane(first: Point, second: Point) -> float:
    """Return how far apart two points are in the plane, m."""
    return math.hypot(first.x - second.x, first.y - second.y)
