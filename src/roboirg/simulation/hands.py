"""The oracle's hands: motion primitives as sequences of straight moves and gripper actions.

Each primitive gives its actions piece by piece; the world has executed one piece before the next
is planned, so every piece starts from where the robot and the objects then are. Way points and
step counts are RoboMME's.
"""

from __future__ import annotations

import itertools
from collections.abc import Callable, Iterator

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from roboirg.episode import Point, Primitive
from roboirg.errors import MotionPlanningError
from roboirg.simulation.planning import Planner, ToolPose, timed
from roboirg.simulation.robot import rotation_of
from roboirg.simulation.settings import HOME
from roboirg.simulation.world import World

OPEN, CLOSED = 1.0, -1.0
GRIPPER_STEPS = 6
"""Control steps in which the gripper opens or closes."""

CUBE_HOVER = 0.15
CONTAINER_HOVER = 0.2
CONTAINER_GRASP = 0.01
"""Tool height above a container's origin, so that the fingers are around the knob."""
TARGET_RELEASE = 0.005
BUTTON_PRESS = 0.0075
PUT_DOWN_RELEASE = 0.07

STRAIGHT_DOWN = Rotation.from_quat([1.0, 0.0, 0.0, 0.0])
"""Fingers down, closing along world y (the rotation at home)."""

Piece = NDArray[np.float64]
"""Actions (n, 8): joint targets and the gripper."""


class Hands:
    """Executes primitives in one world.

    Args:
        world: whose robot and objects they are.
    """

    def __init__(self, world: World) -> None:
        self._world = world
        self._planner = Planner(world.robot)
        self._gripper = OPEN

    def perform(self, primitive: Primitive) -> Iterator[Piece]:
        """The pieces of a primitive; take the next one when the last has been executed.

        Raises:
            MotionPlanningError: a way point cannot be reached.
        """
        return _ROUTINES[primitive.kind](self, primitive)

    def _pick_cube(self, primitive: Primitive) -> Iterator[Piece]:
        yield self._grip(OPEN)
        rotation = self._grasp_rotation(primitive.subject)
        cube = self._position(primitive.subject)
        yield self._move(_above(cube, CUBE_HOVER), rotation)
        yield self._grip(OPEN)
        yield self._move(self._position(primitive.subject), rotation)
        yield self._grip(CLOSED)
        yield self._move(_above(cube, CUBE_HOVER), rotation)

    def _place_on(self, primitive: Primitive) -> Iterator[Piece]:
        place = self._position(str(primitive.place))
        rotation = self._rotation()
        yield self._move(_above(place, CUBE_HOVER), rotation)
        yield self._move(_above(place, TARGET_RELEASE), rotation)
        yield self._grip(OPEN)
        yield self._move(_above(place, CUBE_HOVER), rotation)

    def _press(self, primitive: Primitive) -> Iterator[Piece]:
        button = self._position(primitive.subject)
        yield self._move(_above(button, CUBE_HOVER), STRAIGHT_DOWN)
        yield self._grip(CLOSED)
        yield self._move(_above(button, BUTTON_PRESS), STRAIGHT_DOWN)
        yield self._move(_above(button, CUBE_HOVER), STRAIGHT_DOWN)

    def _pick_container(self, primitive: Primitive) -> Iterator[Piece]:
        yield self._grip(OPEN)
        rotation = self._grasp_rotation(primitive.subject)
        container = self._position(primitive.subject)
        grasp = _above(container, container.z + CONTAINER_GRASP)
        yield self._move(_above(container, CONTAINER_HOVER), rotation)
        yield self._grip(OPEN)
        yield self._move(grasp, rotation)
        yield self._grip(CLOSED)
        yield self._move(_above(container, CONTAINER_HOVER), rotation)

    def _put_down(self, primitive: Primitive) -> Iterator[Piece]:
        here = self._position(primitive.subject)
        rotation = self._rotation()
        yield self._move(_above(here, PUT_DOWN_RELEASE), rotation)
        yield self._grip(OPEN)
        yield self._move(_above(here, CUBE_HOVER), rotation)

    def _hold(self, primitive: Primitive) -> Iterator[Piece]:
        for _ in range(0, primitive.steps, GRIPPER_STEPS):
            yield self._grip(OPEN)

    def _grip(self, gripper: float) -> Piece:
        """Stay where the robot is while the gripper opens or closes."""
        self._gripper = gripper
        return self._with_gripper(np.tile(self._world.robot.arm_positions, (GRIPPER_STEPS, 1)))

    def _move(self, position: Point, rotation: Rotation) -> Piece:
        """Straight to a pose; by way of home where the straight line is not feasible."""
        arm = self._world.robot.arm_positions
        goal = ToolPose(np.asarray(position, dtype=np.float64), rotation)
        try:
            joints = self._planner.straight(arm, goal)
        except MotionPlanningError:
            home = timed(np.linspace(arm, HOME, 10))
            joints = np.concatenate([home, self._planner.straight(HOME, goal)])
        return self._with_gripper(joints)

    def _with_gripper(self, joints: NDArray[np.float64]) -> Piece:
        return np.column_stack([joints, np.full(len(joints), self._gripper)])

    def _position(self, name: str) -> Point:
        return self._world.bodies[name].position

    def _rotation(self) -> Rotation:
        """The tool's present rotation."""
        return rotation_of(self._world.robot.tool_pose)

    def _grasp_rotation(self, name: str) -> Rotation:
        """Fingers down, closing along the object's side nearest to the present closing axis."""
        matrix = self._world.bodies[name].entity.pose.to_transformation_matrix()[:3, :3]
        closing_now = self._rotation().as_matrix()[:, 1]
        flat = [axis for axis in matrix.T if abs(axis[2]) < np.sqrt(0.5)]
        sides = [sign * axis for axis, sign in itertools.product(flat, (1.0, -1.0))]
        closing = max(sides, key=lambda side: float(side @ closing_now)) * (1.0, 1.0, 0.0)
        closing /= np.linalg.norm(closing)
        approach = np.array([0.0, 0.0, -1.0])
        columns = [np.cross(closing, approach), closing, approach]
        return Rotation.from_matrix(np.stack(columns, axis=1))


_ROUTINES: dict[str, Callable[[Hands, Primitive], Iterator[Piece]]] = {
    "pick_cube": Hands._pick_cube,  # noqa: SLF001 - the table belongs to the class
    "place_on": Hands._place_on,  # noqa: SLF001
    "press": Hands._press,  # noqa: SLF001
    "pick_container": Hands._pick_container,  # noqa: SLF001
    "put_down": Hands._put_down,  # noqa: SLF001
    "hold": Hands._hold,  # noqa: SLF001
}


def _above(place: Point, height: float) -> Point:
    return Point(place.x, place.y, height)
