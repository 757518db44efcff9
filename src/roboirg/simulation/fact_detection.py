"""Detect facts: thresholds on positions and contacts, as RoboMME evaluates them.

A fact says what is the case after a control step, for example *placed, cube 1, target 2*;
`roboirg.core.fact_traits` defines each kind. Distances and heights are in meters.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Generator, Iterator, Mapping, Sequence
from collections.abc import Set as AbstractSet
from typing import NamedTuple

import numpy as np
import sapien.physx

from roboirg.core.conditions import Fact
from roboirg.core.fact_traits import FACT_TRAITS
from roboirg.core.motions import Point
from roboirg.simulation.attempt_detection import (
    AttemptDetector,
    NearObject,
    distance_in_plane,
)
from roboirg.simulation.bodies import Body
from roboirg.simulation.panda import Panda
from roboirg.simulation.physics_settings import FINGER_OPEN, HOME

PICKED_HEIGHT = 0.05
RELEASED_HEIGHT = 0.035
ON_TARGET_DISTANCE = 0.05
OVER_DISTANCE = 0.03
OVER_HEIGHT = 0.12
BEYOND_DISTANCE = 0.04
BEYOND_HEIGHT = 0.3
"""A cube that is over a target stays so until it is beyond one of these."""
BINNED_FINGERS = 0.02
BINNED_TOOL_DISTANCE = 0.02
LIFTED_HEIGHT = 0.15
PUT_DOWN_HEIGHT = 0.07
PUT_DOWN_TOOL_HEIGHT = 0.05
PRESSED_DEPTH = 0.005
HOVER_DISTANCE = 0.03
HOVER_HEIGHT = 0.2
NEAR_DISTANCE = 0.06
HOME_TOLERANCE = 0.01
"""Radians of an arm joint, meters of a finger."""
REACHED_DISTANCE = 0.03
REACH = 0.12
"""Objects farther from the tool center than this cannot be between the fingers."""

Contacts = list[sapien.physx.PhysxContact]


class DetectionContext(NamedTuple):
    """The world at one evaluation, for detectors of other packages' kinds of fact.

    Attributes:
        bodies: every object that is in the world, by name.
        robot: the robot.
        tool: position of the tool center, world frame, m.
        contacts: of the last physics step.
        before: the facts of the evaluation before.
    """

    bodies: Mapping[str, Body]
    robot: Panda
    tool: Point
    contacts: Contacts
    before: frozenset[Fact]


class FactDetector:
    """Detects the facts of one world.

    It keeps the last ones: some facts start and cease at different thresholds, or last.

    Args:
        bodies: all objects, by name.
        robot: the robot.

    Attributes:
        attempts: detects what the hand tries.
    """

    def __init__(self, bodies: Mapping[str, Body], robot: Panda) -> None:
        self._robot = robot
        self._bodies = tuple(bodies.values())
        self._targets = self._of_kinds("target")
        self._places = self._of_kinds("target", "site")
        self._bins = self._of_kinds("bin", "box")
        # What follows is of the present step; `detect` sets it before the facts are found.
        self._place_positions: dict[str, Point] = {}
        self._last_facts: frozenset[Fact] = frozenset()
        self._contacts: Contacts = []
        self._stopped: AbstractSet[str] = frozenset()
        self._tool = self._tool_now()
        self.attempts = AttemptDetector(bodies, robot)

    def detect(
        self,
        contacts: Contacts,
        absent: AbstractSet[str] = frozenset(),
        stopped: AbstractSet[str] = frozenset(),
    ) -> frozenset[Fact]:
        """Return all facts that hold now.

        Args:
            contacts: of the last physics step.
            absent: names of objects that are out of the world; the positions at which they are
                kept meanwhile mean nothing.
            stopped: names of objects that have been stopped for good.
        """
        self._contacts = contacts
        self._stopped = stopped
        self._tool = self._tool_now()
        # Read once for all cubes: this is most of what detection costs.
        fixed = (*self._places, *self._bins)
        self._place_positions = {body.item.name: body.position for body in fixed}

        facts = {fact for fact in self._last_facts if fact.traits.lasts}
        present = [body for body in self._bodies if body.item.name not in absent]
        for body in present:
            finder = _FINDERS.get(body.item.kind)
            if finder is not None:
                facts.update(finder(self, body))
        facts.update(self._robot_facts())
        facts.update(self._registered_facts(present))
        self._last_facts = frozenset(facts)
        self.attempts.detect(self._tool, self._last_facts, self._place_positions)
        return self._last_facts

    def _registered_facts(self, present: Sequence[Body]) -> Iterator[Fact]:
        """Yield the facts of the kinds that other packages have registered."""
        detectors = [traits.detect for traits in FACT_TRAITS.values() if traits.detect is not None]
        if not detectors:
            return
        bodies = {body.item.name: body for body in present}
        context = DetectionContext(
            bodies, self._robot, self._tool, self._contacts, self._last_facts
        )
        for detect in detectors:
            for found in detect(context):
                yield Fact(*found)

    def _cube_facts(self, cube: Body) -> Iterator[Fact]:
        """Yield the facts about a cube or a roll of tape: held, over a target, picked or placed.

        *over* begins and ceases at different thresholds (hysteresis), so it reads the last facts.
        """
        name = cube.item.name
        position = cube.position
        is_held = yield from self._hand_facts(cube, position)
        for target in self._targets:
            fact = Fact("over", name, target.item.name)
            if fact in self._last_facts:
                is_low = position.z < BEYOND_HEIGHT
                distance = BEYOND_DISTANCE
            else:
                is_low = position.z < OVER_HEIGHT
                distance = OVER_DISTANCE
            if is_low and self._is_at(position, target, distance):
                yield fact
        if position.z > PICKED_HEIGHT and is_held:
            yield Fact("picked", name)
        if position.z <= RELEASED_HEIGHT and not is_held:
            yield from self._released_facts(name, position)

    def _released_facts(self, name: str, position: Point) -> Iterator[Fact]:
        """Yield where an object lies that the hand has let go."""
        yield Fact("lying", name)
        for place in self._places:
            if self._is_at(position, place, ON_TARGET_DISTANCE):
                yield Fact("placed", name, place.item.name)
        for container in self._bins:
            if (
                self._is_at(position, container, ON_TARGET_DISTANCE)
                and float(self._robot.finger_positions.min()) > BINNED_FINGERS
                and math.dist(position, self._tool) > BINNED_TOOL_DISTANCE
            ):
                yield Fact("binned", name, container.item.name)

    def _is_at(self, position: Point, place: Body, distance: float) -> bool:
        """Return whether a position is within a distance of a place's center in the plane."""
        center = self._place_positions[place.item.name]
        return distance_in_plane(position, center) <= distance

    def _container_facts(self, container: Body) -> Iterator[Fact]:
        """Yield the facts about a container: held, lifted or put down."""
        name = container.item.name
        position = container.position
        is_held = yield from self._hand_facts(container, position)
        is_down = position.z <= PUT_DOWN_HEIGHT and not is_held
        if position.z > LIFTED_HEIGHT:
            yield Fact("lifted", name)
        if is_down and self._tool.z > PUT_DOWN_TOOL_HEIGHT:
            yield Fact("put_down", name)

    def _button_facts(self, button: Body) -> Iterator[Fact]:
        """Yield whether a button is pressed, and whether the hand hovers over it."""
        if button.pressed_depth > PRESSED_DEPTH:
            yield Fact("pressed", button.item.name)
        distance = distance_in_plane(self._tool, button.position)
        if self._tool.z < HOVER_HEIGHT and distance <= HOVER_DISTANCE:
            yield Fact("hovering", "robot", button.item.name)

    def _shuttle_facts(self, shuttle: Body) -> Iterator[Fact]:
        """Yield the facts about a cube that moves back and forth by itself."""
        name = shuttle.item.name
        for target in self._targets:
            if distance_in_plane(shuttle.position, target.position) <= NEAR_DISTANCE:
                yield Fact("near", name, target.item.name)
                if name in self._stopped:
                    yield Fact("stopped", name, target.item.name)

    def _robot_facts(self) -> Iterator[Fact]:
        """Yield whether the robot is still, and whether it is at home with open fingers."""
        if self._robot.is_still():
            yield Fact("still", "robot")
        arm_error = np.abs(self._robot.arm_positions - HOME).max()
        finger_error = np.abs(self._robot.finger_positions - FINGER_OPEN).max()
        if max(arm_error, finger_error) < HOME_TOLERANCE:
            yield Fact("home", "robot")

    def _hand_facts(self, body: Body, position: Point) -> Generator[Fact, None, bool]:
        """Yield the facts about the hand at a movable object; return whether the hand holds it.

        Callers get the return value by ``yield from``. The object is noted for the attempts, too.
        """
        apart = distance_in_plane(position, self._tool)
        if apart > REACH:  # spares the search through all contacts
            return False
        distance = math.dist(position, self._tool)
        if distance <= REACHED_DISTANCE:
            yield Fact("reached", body.item.name)
        is_held = distance <= REACH and self._robot.grasps(body.physics, self._contacts)
        if is_held:
            yield Fact("held", body.item.name)
        gap = apart - body.item.half_width
        self.attempts.near.append(NearObject(body.item, position, gap, is_held))
        return is_held

    def _of_kinds(self, *kinds: str) -> list[Body]:
        """Return the objects of each of some kinds in turn."""
        return [body for kind in kinds for body in self._bodies if body.item.kind == kind]

    def _tool_now(self) -> Point:
        """Return the tool center."""
        return Point(*self._robot.tool_pose.p.tolist())


# No bound methods: the cycle would keep the world until the next collection.
# ruff: noqa: SLF001
_FINDERS: Mapping[str, Callable[[FactDetector, Body], Iterator[Fact]]] = {
    "cube": FactDetector._cube_facts,
    "tape": FactDetector._cube_facts,
    "container": FactDetector._container_facts,
    "button": FactDetector._button_facts,
    "shuttle": FactDetector._shuttle_facts,
}
"""What finds the facts about an object of a kind."""
