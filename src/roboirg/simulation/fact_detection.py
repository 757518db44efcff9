"""Detect facts: thresholds on positions and contacts, as RoboMME evaluates them."""

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
from roboirg.simulation.attempt_detection import AttemptDetector, distance_in_plane
from roboirg.simulation.bodies import Body
from roboirg.simulation.panda import Panda
from roboirg.simulation.physics_settings import FINGER_OPEN, HOME

PICKED_HEIGHT = 0.05
RELEASED_HEIGHT = 0.035
ON_TARGET_DISTANCE = 0.05
OVER_DISTANCE, OVER_HEIGHT = 0.03, 0.12
BEYOND_DISTANCE, BEYOND_HEIGHT = 0.04, 0.3
"""A cube that is over a target stays so until it is beyond one of these."""
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
"""Objects farther from the tool center than this cannot be between the fingers, m."""

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

    Attributes:
        attempts: detects what the hand tries.
    """

    def __init__(self, bodies: Mapping[str, Body], robot: Panda) -> None:
        self._robot = robot
        self._bodies = tuple(bodies.values())
        self._targets = self._of_kind("target")
        self._places = (*self._targets, *self._of_kind("site"))
        self._bins = (*self._of_kind("bin"), *self._of_kind("box"))
        self._spots: dict[str, Point] = {}
        self._before: frozenset[Fact] = frozenset()
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
        self._contacts, self._tool, self._stopped = contacts, self._tool_now(), stopped
        # Read once for all cubes: this is most of what detection costs.
        fixed = (*self._places, *self._bins)
        self._spots = {body.item.name: body.position for body in fixed}
        present = [body for body in self._bodies if body.item.name not in absent]
        facts = {fact for fact in self._before if fact.traits.lasts}
        for body in present:
            if body.item.kind in _FINDERS:
                facts.update(_FINDERS[body.item.kind](self, body))
        facts.update(self._robot_facts())
        facts.update(self._registered_facts(present))
        self._before = frozenset(facts)
        self.attempts.detect(self._tool, self._before, self._spots)
        return self._before

    def _registered_facts(self, present: Sequence[Body]) -> Iterator[Fact]:
        """Yield the facts of the kinds that other packages have registered."""
        detectors = [one.detect for one in FACT_TRAITS.values() if one.detect is not None]
        if detectors:
            bodies = {body.item.name: body for body in present}
            context = DetectionContext(
                bodies, self._robot, self._tool, self._contacts, self._before
            )
            for detect in detectors:
                yield from (Fact(*found) for found in detect(context))

    def _cube_facts(self, cube: Body) -> Iterator[Fact]:
        name, position = cube.item.name, cube.position
        held = yield from self._hand_facts(cube, position)
        for target in self._targets:
            fact = Fact("over", name, target.item.name)
            distance, height = BEYOND_DISTANCE, BEYOND_HEIGHT
            if fact not in self._before:
                distance, height = OVER_DISTANCE, OVER_HEIGHT
            if (
                position.z < height
                and distance_in_plane(position, self._spots[target.item.name]) <= distance
            ):
                yield fact
        if position.z > PICKED_HEIGHT:
            if held:
                yield Fact("picked", name)
        elif position.z <= RELEASED_HEIGHT and not held:
            yield from self._released_facts(name, position)

    def _released_facts(self, name: str, position: Point) -> Iterator[Fact]:
        yield Fact("lying", name)
        yield from (
            Fact("placed", name, place.item.name)
            for place in self._places
            if distance_in_plane(position, self._spots[place.item.name]) <= ON_TARGET_DISTANCE
        )
        yield from (
            Fact("binned", name, bin_.item.name)
            for bin_ in self._bins
            if distance_in_plane(position, self._spots[bin_.item.name]) <= ON_TARGET_DISTANCE
            and float(self._robot.finger_positions.min()) > BINNED_FINGERS
            and math.dist(position, self._tool) > BINNED_TOOL_DISTANCE
        )

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
        apart = distance_in_plane(self._tool, button.position)
        if self._tool.z < HOVER_HEIGHT and apart <= HOVER_DISTANCE:
            yield Fact("hovering", "robot", button.item.name)

    def _shuttle_facts(self, shuttle: Body) -> Iterator[Fact]:
        for target in self._targets:
            if distance_in_plane(shuttle.position, target.position) <= NEAR_DISTANCE:
                yield Fact("near", shuttle.item.name, target.item.name)
                if shuttle.item.name in self._stopped:
                    yield Fact("stopped", shuttle.item.name, target.item.name)

    def _robot_facts(self) -> Iterator[Fact]:
        if self._robot.is_still():
            yield Fact("still", "robot")
        arm, fingers = self._robot.arm_positions, self._robot.finger_positions
        away = max(np.abs(arm - HOME).max(), np.abs(fingers - FINGER_OPEN).max())
        if away < HOME_TOLERANCE:
            yield Fact("home", "robot")

    def _hand_facts(self, body: Body, position: Point) -> Generator[Fact, None, bool]:
        """Yield the facts about the hand at a movable object; return whether the hand holds it."""
        apart = distance_in_plane(position, self._tool)
        if apart > REACH:
            return False
        distance = math.dist(position, self._tool)
        if distance <= REACHED_DISTANCE:
            yield Fact("reached", body.item.name)
        held = distance <= REACH and self._robot.grasps(body.physics, self._contacts)
        if held:
            yield Fact("held", body.item.name)
        self.attempts.near.append((body.item, position, apart - body.item.half_width, held))
        return held

    def _of_kind(self, kind: str) -> tuple[Body, ...]:
        return tuple(body for body in self._bodies if body.item.kind == kind)

    def _tool_now(self) -> Point:
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
