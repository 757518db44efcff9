"""The oracle's hands: motion primitives as sequences of straight moves and gripper actions.

Each primitive gives its actions piece by piece; the world has executed one piece before the next
is planned, so every piece starts from where the robot and the objects then are. Way points and
step counts are RoboMME's.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from roboirg.core.actions import ARM_JOINTS
from roboirg.core.episode import Primitive
from roboirg.core.errors import MotionPlanningError
from roboirg.core.motions import Point
from roboirg.simulation.expert.grasping import grasp_rotations
from roboirg.simulation.expert.motion_planning import MotionPlanner, ToolPose
from roboirg.simulation.panda import rotation_of
from roboirg.simulation.physics_settings import CLOSED, GRIPPER_STEPS, HOME_ACTION, OPEN
from roboirg.simulation.world import World

CUBE_HOVER = 0.15
CONTAINER_HOVER = 0.2
CONTAINER_GRASP = 0.01
"""Tool height above a container's origin, so that the fingers are around the knob."""
TARGET_RELEASE = 0.005
SITE_RELEASE = 0.01
BIN_RELEASE = 0.2
BOX_RELEASE = 0.065
"""Tool height at which the open fingers stay above the walls of a box."""
BIN_RETREAT = 0.1
"""How far the hand goes back towards the robot after letting go over the bin."""
OVER_TARGET = 0.1
BUTTON_PRESS = 0.0075
BUTTON_CONTACT = 0.037
"""Tool height at which closed fingers have pressed a button."""
ARM_LAG = 3
"""Control steps by which the arm is behind its targets."""
ASIDE = Point(0.0, 0.0, 0.2)
HOMING_STEPS = 30

STRAIGHT_DOWN = Rotation.from_quat([1.0, 0.0, 0.0, 0.0])
"""Fingers down, closing along world y (the rotation at home)."""

Piece = NDArray[np.float64]
"""Actions (n, 8): joint targets and the gripper."""


class MotionPrimitives:
    """Executes primitives in one world.

    Args:
        world: whose robot and objects they are.
    """

    def __init__(self, world: World) -> None:
        self._world = world
        self._planner = MotionPlanner(world.robot)
        self._gripper = OPEN

    def perform(self, primitive: Primitive) -> Iterator[Piece]:
        """The pieces of a primitive; take the next one when the last has been executed.

        Raises:
            MotionPlanningError: a way point cannot be reached.
        """
        return _ROUTINES[primitive.kind](self, primitive)

    def _pick_cube(self, primitive: Primitive) -> Iterator[Piece]:
        yield self._grip(OPEN)
        cube = self._position(primitive.subject)
        way, rotation = self._approach(primitive.subject, CUBE_HOVER)
        yield way
        yield self._grip(OPEN)
        yield self._move(self._position(primitive.subject), rotation)
        yield self._grip(CLOSED)
        yield self._move(_above(cube, CUBE_HOVER), rotation)

    def _place_on(self, primitive: Primitive) -> Iterator[Piece]:
        place, rotation = self._place(primitive), self._rotation()
        seen = self._world.bodies[str(primitive.place)].item.kind != "site"
        yield self._move(_above(place, CUBE_HOVER), rotation)
        yield self._move(_above(place, TARGET_RELEASE if seen else SITE_RELEASE), rotation)
        yield self._grip(OPEN)
        yield self._move(_above(place, CUBE_HOVER), rotation)

    def _drop_into(self, primitive: Primitive) -> Iterator[Piece]:
        place, rotation = self._place(primitive), self._rotation()
        yield self._move(_above(place, BIN_RELEASE), rotation)
        yield self._grip(OPEN)
        back = place._replace(x=place.x - BIN_RETREAT)
        yield self._move(_above(back, BIN_RELEASE), rotation)

    def _put_into(self, primitive: Primitive) -> Iterator[Piece]:
        place, rotation = self._place(primitive), self._rotation()
        yield self._move(_above(place, CUBE_HOVER), rotation)
        yield self._move(_above(place, BOX_RELEASE), rotation)
        yield self._grip(OPEN)
        yield self._move(_above(place, CUBE_HOVER), rotation)

    def _move_over(self, primitive: Primitive) -> Iterator[Piece]:
        yield self._move(_above(self._place(primitive), OVER_TARGET), self._rotation())

    def _press(self, primitive: Primitive) -> Iterator[Piece]:
        yield self._move(_above(self._position(primitive.subject), CUBE_HOVER), STRAIGHT_DOWN)
        yield from self._press_below(primitive)

    def _press_below(self, primitive: Primitive) -> Iterator[Piece]:
        button = self._position(primitive.subject)
        yield self._grip(CLOSED)
        down = self._move(_above(button, BUTTON_PRESS), STRAIGHT_DOWN)
        wait = primitive.steps - self._world.elapsed - self._steps_to_press(down)
        if wait > 0:
            yield np.tile(down[0], (wait, 1))
        yield down
        yield self._move(_above(button, CUBE_HOVER), STRAIGHT_DOWN)

    def _steps_to_press(self, down: Piece) -> int:
        """How many control steps of a way down pass until the button is pressed."""
        heights = [self._planner.forward(arm).position[2] for arm in down[:, :ARM_JOINTS]]
        return int(np.count_nonzero(np.array(heights) > BUTTON_CONTACT)) + ARM_LAG

    def _hover(self, primitive: Primitive) -> Iterator[Piece]:
        yield self._move(_above(self._position(primitive.subject), CUBE_HOVER), STRAIGHT_DOWN)
        yield self._grip(CLOSED)

    def _pick_container(self, primitive: Primitive) -> Iterator[Piece]:
        yield self._grip(OPEN)
        container = self._position(primitive.subject)
        grasp = _above(container, container.z + CONTAINER_GRASP)
        way, rotation = self._approach(primitive.subject, CONTAINER_HOVER)
        yield way
        yield self._grip(OPEN)
        yield self._move(grasp, rotation)
        yield self._grip(CLOSED)
        yield self._move(_above(container, CONTAINER_HOVER), rotation)

    def _put_down(self, primitive: Primitive) -> Iterator[Piece]:
        here = self._position(primitive.subject)
        rotation = self._rotation()
        yield self._move(_above(here, primitive.height), rotation)
        yield self._grip(OPEN)
        yield self._move(_above(here, CUBE_HOVER), rotation)

    def _hold(self, primitive: Primitive) -> Iterator[Piece]:
        for _ in range(0, primitive.steps, GRIPPER_STEPS):
            yield self._grip(OPEN)

    def _hold_until(self, primitive: Primitive) -> Iterator[Piece]:
        while (left := primitive.steps - self._world.elapsed) > 0:
            yield self._grip(CLOSED)[:left]

    def _retreat(self, primitive: Primitive) -> Iterator[Piece]:
        yield self._move(ASIDE, self._rotation())
        yield self._grip(OPEN)
        yield from self._hold(primitive)

    def _go_home(self, primitive: Primitive) -> Iterator[Piece]:
        del primitive
        yield self._grip(OPEN)
        yield np.tile(HOME_ACTION, (HOMING_STEPS, 1))

    def _grip(self, gripper: float) -> Piece:
        """Stay where the robot is while the gripper opens or closes."""
        self._gripper = gripper
        return self._with_gripper(np.tile(self._world.robot.arm_positions, (GRIPPER_STEPS, 1)))

    def _approach(self, name: str, height: float) -> tuple[Piece, Rotation]:
        """The way to above an object, and the rotation in which to grasp it there."""
        goal = _above(self._position(name), height)
        rotations = grasp_rotations(name, self._world.bodies, self._rotation())
        for rotation in rotations[:-1]:
            try:
                return self._move(goal, rotation), rotation
            except MotionPlanningError:
                continue  # a limit of the wrist; from another side it may do
        return self._move(goal, rotations[-1]), rotations[-1]

    def _move(self, position: Point, rotation: Rotation) -> Piece:
        """Straight to a pose; by way of home where the straight line is not feasible."""
        goal = ToolPose(np.asarray(position, dtype=np.float64), rotation)
        return self._with_gripper(self._planner.travel(self._world.robot.arm_positions, goal))

    def _with_gripper(self, joints: NDArray[np.float64]) -> Piece:
        return np.column_stack([joints, np.full(len(joints), self._gripper)])

    def _position(self, name: str) -> Point:
        return self._world.bodies[name].position

    def _place(self, primitive: Primitive) -> Point:
        return self._position(str(primitive.place))

    def _rotation(self) -> Rotation:
        """The tool's present rotation."""
        return rotation_of(self._world.robot.tool_pose)


# The table belongs to the class.
# ruff: noqa: SLF001
_ROUTINES: dict[str, Callable[[MotionPrimitives, Primitive], Iterator[Piece]]] = {
    "pick_cube": MotionPrimitives._pick_cube,
    "place_on": MotionPrimitives._place_on,
    "drop_into": MotionPrimitives._drop_into,
    "put_into": MotionPrimitives._put_into,
    "move_over": MotionPrimitives._move_over,
    "put_down": MotionPrimitives._put_down,
    "pick_container": MotionPrimitives._pick_container,
    "press": MotionPrimitives._press,
    "press_below": MotionPrimitives._press_below,
    "hover": MotionPrimitives._hover,
    "hold": MotionPrimitives._hold,
    "hold_until": MotionPrimitives._hold_until,
    "retreat": MotionPrimitives._retreat,
    "go_home": MotionPrimitives._go_home,
}


def _above(place: Point, height: float) -> Point:
    return Point(place.x, place.y, height)
