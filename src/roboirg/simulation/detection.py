"""Which facts hold: thresholds on positions and contacts, as RoboMME evaluates them."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence

import sapien.physx

from roboirg.episode import Fact
from roboirg.simulation.bodies import Body
from roboirg.simulation.robot import Robot

PICKED_HEIGHT = 0.05
RELEASED_HEIGHT = 0.035
ON_TARGET_DISTANCE = 0.05
LIFTED_HEIGHT = 0.15
PUT_DOWN_HEIGHT = 0.07
PUT_DOWN_TOOL_HEIGHT = 0.05
PRESSED_DEPTH = 0.005


def detect(
    bodies: Sequence[Body], robot: Robot, contacts: list[sapien.physx.PhysxContact]
) -> frozenset[Fact]:
    """All facts that hold now.

    Args:
        bodies: every object of the scene.
        robot: the robot.
        contacts: of the last physics step.
    """
    facts: set[Fact] = set()
    targets = [body for body in bodies if body.item.kind == "target"]
    for body in bodies:
        if body.item.kind == "cube":
            facts.update(_cube_facts(body, targets, robot, contacts))
        elif body.item.kind == "container":
            facts.update(_container_facts(body, robot, contacts))
        elif body.item.kind == "button" and body.pressed_depth > PRESSED_DEPTH:
            facts.add(Fact("pressed", body.item.name))
    if robot.is_still():
        facts.add(Fact("still", "robot"))
    return frozenset(facts)


def _cube_facts(
    cube: Body, targets: Sequence[Body], robot: Robot, contacts: list[sapien.physx.PhysxContact]
) -> Iterator[Fact]:
    position = cube.position
    if position.z > PICKED_HEIGHT:
        if robot.grasps(cube.physics, contacts):
            yield Fact("picked", cube.item.name)
    elif position.z <= RELEASED_HEIGHT:
        near = [
            target.item.name
            for target in targets
            if math.hypot(position.x - target.position.x, position.y - target.position.y)
            <= ON_TARGET_DISTANCE
        ]
        if near and not robot.grasps(cube.physics, contacts):
            yield from (Fact("placed", cube.item.name, name) for name in near)


def _container_facts(
    container: Body, robot: Robot, contacts: list[sapien.physx.PhysxContact]
) -> Iterator[Fact]:
    height = container.position.z
    if height > LIFTED_HEIGHT:
        yield Fact("lifted", container.item.name)
    elif (
        height <= PUT_DOWN_HEIGHT
        and robot.tool_pose.p[2] > PUT_DOWN_TOOL_HEIGHT
        and not robot.grasps(container.physics, contacts)
    ):
        yield Fact("put_down", container.item.name)
