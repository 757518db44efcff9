"""Which facts hold: thresholds on positions and contacts, as RoboMME evaluates them."""

from __future__ import annotations

import math
from collections.abc import Generator, Iterator, Mapping
from collections.abc import Set as AbstractSet

import numpy as np
import sapien.physx

from roboirg.core.conditions import Fact
from roboirg.core.motions import Point
from roboirg.simulation.bodies import Body
from roboirg.simulation.panda import Panda
from roboirg.simulation.physics_settings import FINGER_OPEN, HOME

PICKED_HEIGHT = 0.05
RELEASED_HEIGHT = 0.035
ON_TARGET_DISTANCE = 0.05
OVER_DISTANCE, OVER_HEIGHT = 0.03, 0.12
BEYOND_DISTANCE, BEYOND_HEIGHT = 0.04, 0.3
"""How far a cube over a target has to go until it is not over it any more."""
BINNED_FINGERS, BINNED_TOOL_DISTANCE = 0.02, 0.02
LIFTED_HEIGHT = 0.15
PUT_DOWN_HEIGHT = 0.07
PUT_DOWN_TOOL_HEIGHT = 0.05
PRESSED_DEPTH = 0.005
HOVER_DISTANCE, HOVER_HEIGHT = 0.03, 0.2
NEAR_DISTANCE = 0.06
HOME_TOLERANCE = 0.01
REACHED_DISTANCE = 0.03
REACH = 0.12
"""What is farther from the tool center point than this cannot be between the fingers, m."""

Contacts = list[sapien.physx.PhysxContact]


class FactDetector:
    """Finds the facts of one world.

    It remembers the last ones: some facts begin and cease at different thresholds, or stay.

    Args:
        bodies: every object of the scene by name.
        robot: the robot.
    """

    def __init__(self, bodies: Mapping[str, Body], robot: Panda) -> None:
        self._robot = robot
        self._bodies = tuple(bodies.values())
        self._targets = self._of_kind("target")
        self._places = (*self._targets, *self._of_kind("site"))
        self._bins = (*self._of_kind("bin"), *self._of_kind("box"))
        self._before: frozenset[Fact] = frozenset()
        self._contacts: Contacts = []
        self._tool = self._tool_now()

    def detect(
        self,
        contacts: Contacts,
        absent: AbstractSet[str] = frozenset(),
        stopped: AbstractSet[str] = frozenset(),
    ) -> frozenset[Fact]:
        """All facts that hold now.

        Args:
            contacts: of the last physics step.
            absent: names of objects that are out of the world: nothing is concluded from where
                they are kept meanwhile.
            stopped: names of objects that have been stopped for good.
        """
        self._contacts, self._tool = contacts, self._tool_now()
        facts = {fact for fact in self._before if fact.kind == "binned"}
        for body in self._bodies:
            if body.item.name in absent:
                continue
            if body.item.kind in ("cube", "tape"):
                facts.update(self._cube_facts(body))
            elif body.item.kind == "container":
                facts.update(self._container_facts(body))
            elif body.item.kind == "button":
                facts.update(self._button_facts(body))
            elif body.item.kind == "shuttle":
                facts.update(self._shuttle_facts(body, stopped=body.item.name in stopped))
        facts.update(self._robot_facts())
        self._before = frozenset(facts)
        return self._before

    def _cube_facts(self, cube: Body) -> Iterator[Fact]:
        name, position = cube.item.name, cube.position
        held = yield from self._hand_facts(cube, position)
        for target in self._targets:
            fact = Fact("over", name, target.item.name)
            distance, height = BEYOND_DISTANCE, BEYOND_HEIGHT
            if fact not in self._before:
                distance, height = OVER_DISTANCE, OVER_HEIGHT
            if position.z < height and _apart(position, target.position) <= distance:
                yield fact
        if position.z > PICKED_HEIGHT:
            if held:
                yield Fact("picked", name)
        elif position.z <= RELEASED_HEIGHT and not held:
            yield from self._released_facts(name, position)

    def _released_facts(self, name: str, position: Point) -> Iterator[Fact]:
        yield Fact("lying", name)
        for place in self._places:
            if _apart(position, place.position) <= ON_TARGET_DISTANCE:
                yield Fact("placed", name, place.item.name)
        for bin_ in self._bins:
            if (
                _apart(position, bin_.position) <= ON_TARGET_DISTANCE
                and float(self._robot.finger_positions.min()) > BINNED_FINGERS
                and math.dist(position, self._tool) > BINNED_TOOL_DISTANCE
            ):
                yield Fact("binned", name, bin_.item.name)

    def _container_facts(self, container: Body) -> Iterator[Fact]:
        position = container.position
        height, held = position.z, (yield from self._hand_facts(container, position))
        if height > LIFTED_HEIGHT:
            yield Fact("lifted", container.item.name)
        elif height <= PUT_DOWN_HEIGHT and self._tool.z > PUT_DOWN_TOOL_HEIGHT and not held:
            yield Fact("put_down", container.item.name)

    def _button_facts(self, button: Body) -> Iterator[Fact]:
        if button.pressed_depth > PRESSED_DEPTH:
            yield Fact("pressed", button.item.name)
        if self._tool.z < HOVER_HEIGHT and _apart(self._tool, button.position) <= HOVER_DISTANCE:
            yield Fact("hovering", "robot", button.item.name)

    def _shuttle_facts(self, shuttle: Body, *, stopped: bool) -> Iterator[Fact]:
        for target in self._targets:
            if _apart(shuttle.position, target.position) <= NEAR_DISTANCE:
                yield Fact("near", shuttle.item.name, target.item.name)
                if stopped:
                    yield Fact("stopped", shuttle.item.name, target.item.name)

    def _robot_facts(self) -> Iterator[Fact]:
        if self._robot.is_still():
            yield Fact("still", "robot")
        arm, fingers = self._robot.arm_positions, self._robot.finger_positions
        away = max(np.abs(arm - HOME).max(), np.abs(fingers - FINGER_OPEN).max())
        if away < HOME_TOLERANCE:
            yield Fact("home", "robot")

    def _hand_facts(self, body: Body, position: Point) -> Generator[Fact, None, bool]:
        """Where the hand is at something movable; gives back whether it is held."""
        distance = math.dist(position, self._tool)
        if distance > REACH:
            return False
        if distance <= REACHED_DISTANCE:
            yield Fact("reached", body.item.name)
        held = self._robot.grasps(body.physics, self._contacts)
        if held:
            yield Fact("held", body.item.name)
        return held

    def _of_kind(self, kind: str) -> tuple[Body, ...]:
        return tuple(body for body in self._bodies if body.item.kind == kind)

    def _tool_now(self) -> Point:
        return Point(*(float(value) for value in self._robot.tool_pose.p))


def _apart(first: Point, second: Point) -> float:
    """Distance in the plane, m."""
    return math.hypot(first.x - second.x, first.y - second.y)
