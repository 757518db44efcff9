"""Motion primitives of the scripted expert: sequences of straight moves and gripper actions.

Each primitive yields one trajectory at a time; the world executes it before the next is planned, so
each starts from the current state of the robot and the objects. Waypoints and step counts are
RoboMME's.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterator, Sequence
from typing import NamedTuple

import numpy as np
from scipy.spatial.transform import Rotation

from roboirg.core.actions import ARM_JOINTS
from roboirg.core.conditions import Fact
from roboirg.core.episode import ROBOT, ROBOT_BASE, Primitive
from roboirg.core.errors import MotionPlanningError
from roboirg.core.motions import Point
from roboirg.simulation.expert.grasping import grasp_rotations
from roboirg.simulation.expert.motion_planning import MotionPlanner, ToolPose
from roboirg.simulation.panda import JointTrajectory, rotation_of, with_gripper
from roboirg.simulation.physics_settings import CLOSED, GRIPPER_STEPS, HOME_ACTION, OPEN
from roboirg.simulation.world import World

CUBE_HOVER = 0.15
CONTAINER_HOVER = 0.2
"""Tool heights before and after handling an object. Heights are above the table, in meters."""
CONTAINER_GRASP = 0.01
"""Tool height above a container's origin at which the fingers enclose the knob."""
TARGET_RELEASE = 0.005
RELEASES = {"site": 0.01, "box": 0.065}
"""Tool heights at which an object is let go over another kind of place; in a box, the open fingers
stay above the walls."""
BIN_RELEASE = 0.2
BIN_RETREAT = 0.1
"""Meters by which the hand moves back towards the robot after releasing over the bin."""
OVER_TARGET = 0.1
"""Tool height at which a cube is carried over a target."""
BUTTON_PRESS = 0.0075
BUTTON_CONTACT = 0.037
"""Tool height at which closed fingers have pressed a button."""
ARM_LAG = 3
"""Control steps by which the arm lags behind its targets."""
NARROW = 0.6
"""Gripper action that leaves 0.06 m between the fingers, to pick a cube with others close by; used
after the pick with open fingers has failed, as they landed on something."""
SHORTFALLS = (0.0, 0.0025, 0.005, 0.0075, 0.01)
"""Meters by which a move stays short of a place that lies just beyond the arm's reach."""
ASIDE = Point(0.0, 0.0, 0.2)
"""Where the tool goes to be away from the objects, world frame, m."""
HOMING_STEPS = 30

STRAIGHT_DOWN = Rotation.from_quat([1.0, 0.0, 0.0, 0.0])
"""Fingers down, closing along world y (the rotation at home)."""


class Approach(NamedTuple):
    """A move of the tool, and the rotation that it ends with."""

    trajectory: JointTrajectory
    rotation: Rotation


class MotionPrimitives:
    """Plans the movements of motion primitives in one world, such as *pick_cube* or *press*.

    ``_do_KIND`` is the routine of each kind. Each yields joint trajectories (n, 8): one is planned
    when the one before has been executed, from where robot and objects are then.
    """

    def __init__(self, world: World) -> None:
        self._world = world
        self._planner = MotionPlanner(world.robot)
        self._gripper = OPEN

    @property
    def gripper(self) -> float:
        """The gripper action of the last trajectory."""
        return self._gripper

    def execute(self, primitive: Primitive) -> Iterator[JointTrajectory]:
        """Yield the trajectories of a primitive; take the next after executing the last."""
        routine = getattr(self, f"_do_{primitive.kind}")
        yield from routine(primitive)

    def _do_pick_cube(self, primitive: Primitive) -> Iterator[JointTrajectory]:
        """Yield the trajectories that pick a cube; if it fails, again with narrow fingers."""
        for opening in (OPEN, NARROW):
            yield from self._grasp_and_lift(primitive.subject, opening)
            if Fact("picked", primitive.subject) in self._world.facts:
                return

    def _grasp_and_lift(self, cube: str, opening: float) -> Iterator[JointTrajectory]:
        """Yield the trajectories that pick a cube with the gripper opened to `opening`."""
        yield self._grip(opening)
        start = self._position(cube)
        approach = self._approach(cube, CUBE_HOVER)
        yield approach.trajectory
        yield self._grip(opening)
        yield self._move(self._position(cube), approach.rotation)
        yield self._grip(CLOSED)
        yield self._move_over(start, CUBE_HOVER, approach.rotation)

    def _do_place_on(self, primitive: Primitive) -> Iterator[JointTrajectory]:
        """Yield the trajectories that let go of a thing over a place, at its kind's height."""
        place = self._place(primitive)
        rotation = self._rotation()
        kind = self._world.bodies[str(primitive.place)].item.kind
        height = RELEASES.get(kind, TARGET_RELEASE)
        yield self._move_over(place, CUBE_HOVER, rotation)
        yield self._move_over(place, height, rotation)
        yield self._grip(OPEN)
        yield self._move_over(place, CUBE_HOVER, rotation)

    _do_put_into = _do_place_on

    def _do_drop_into(self, primitive: Primitive) -> Iterator[JointTrajectory]:
        """Yield the trajectories that let an object fall into a bin, and draw the hand back."""
        place = self._place(primitive)
        rotation = self._rotation()
        yield self._move_over(place, BIN_RELEASE, rotation)
        yield self._grip(OPEN)
        back = place._replace(x=place.x - BIN_RETREAT)
        yield self._move_over(back, BIN_RELEASE, rotation)

    def _do_move_over(self, primitive: Primitive) -> Iterator[JointTrajectory]:
        """Yield the trajectory that carries what is held over a place."""
        yield self._move_over(self._place(primitive), OVER_TARGET, self._rotation())

    def _do_press(self, primitive: Primitive) -> Iterator[JointTrajectory]:
        """Yield the trajectories that go over a button and press it."""
        yield self._move_over(self._position(primitive.subject), CUBE_HOVER, STRAIGHT_DOWN)
        yield from self._do_press_below(primitive)

    def _do_press_below(self, primitive: Primitive) -> Iterator[JointTrajectory]:
        """Yield the trajectories that press the button below the hand, when its time has come.

        `primitive.steps` is the control step, since the start of the world, at which it shall be
        pressed; the hand waits above as long as it must. Without waiting, 0 presses at once.
        """
        button = self._position(primitive.subject)
        yield self._grip(CLOSED)
        down = self._move_over(button, BUTTON_PRESS, STRAIGHT_DOWN)
        steps_left = primitive.steps - self._world.elapsed
        waiting_steps = steps_left - self._steps_to_press(down)
        if waiting_steps > 0:
            yield np.tile(down[0], (waiting_steps, 1))
        yield down
        yield self._move_over(button, CUBE_HOVER, STRAIGHT_DOWN)

    def _steps_to_press(self, down: JointTrajectory) -> int:
        """Return the number of control steps of a descent (n, 8) until the button is pressed."""
        steps_above = 0
        for arm in down[:, :ARM_JOINTS]:
            tool = self._planner.forward_kinematics(arm)
            if tool.position[2] > BUTTON_CONTACT:
                steps_above += 1
        return steps_above + ARM_LAG

    def _do_hover(self, primitive: Primitive) -> Iterator[JointTrajectory]:
        """Yield the trajectories that wait over a button, with closed fingers."""
        yield self._move_over(self._position(primitive.subject), CUBE_HOVER, STRAIGHT_DOWN)
        yield self._grip(CLOSED)

    def _do_pick_container(self, primitive: Primitive) -> Iterator[JointTrajectory]:
        """Yield the trajectories that lift a container by its knob."""
        yield self._grip(OPEN)
        container = self._position(primitive.subject)
        approach = self._approach(primitive.subject, CONTAINER_HOVER)
        yield approach.trajectory
        yield self._grip(OPEN)
        yield self._move_over(container, container.z + CONTAINER_GRASP, approach.rotation)
        yield self._grip(CLOSED)
        yield self._move_over(container, CONTAINER_HOVER, approach.rotation)

    def _do_put_down(self, primitive: Primitive) -> Iterator[JointTrajectory]:
        """Yield the trajectories that let go of what the hand holds where it is.

        An empty hand, of which the subject is the robot, goes down in the same way.
        """
        if primitive.subject == ROBOT:
            start = Point(*self._world.robot.tool_pose.p.tolist())
        else:
            start = self._position(primitive.subject)
        rotation = self._rotation()
        yield self._move_over(start, primitive.height, rotation)
        yield self._grip(OPEN)
        yield self._move_over(start, CUBE_HOVER, rotation)

    def _do_hold(self, primitive: Primitive) -> Iterator[JointTrajectory]:
        """Yield trajectories at rest with open fingers, for at least `primitive.steps` steps."""
        for _ in range(0, primitive.steps, GRIPPER_STEPS):
            yield self._grip(OPEN)

    def _do_hold_until(self, primitive: Primitive) -> Iterator[JointTrajectory]:
        """Yield trajectories at rest with closed fingers, until step `primitive.steps`."""
        while self._world.elapsed < primitive.steps:
            steps_left = primitive.steps - self._world.elapsed
            yield self._grip(CLOSED)[:steps_left]

    def _do_retreat(self, primitive: Primitive) -> Iterator[JointTrajectory]:
        """Yield the trajectories that move the hand aside, open it, and hold."""
        yield self._move(ASIDE, self._rotation())
        yield self._grip(OPEN)
        yield from self._do_hold(primitive)

    def _do_go_home(self, primitive: Primitive) -> Iterator[JointTrajectory]:
        """Yield the trajectories that open the gripper and drive the joints home."""
        del primitive
        yield self._grip(OPEN)
        yield np.tile(HOME_ACTION, (HOMING_STEPS, 1))

    def _grip(self, gripper: float) -> JointTrajectory:
        """Hold the arm still while the gripper opens or closes, as later moves keep it."""
        self._gripper = gripper
        at_rest = np.tile(self._world.robot.arm_positions, (GRIPPER_STEPS, 1))
        return with_gripper(at_rest, gripper)

    def _approach(self, name: str, height: float) -> Approach:
        """Plan a move to a height above the table, m, over an object, turned for grasping it."""
        rotations = grasp_rotations(name, self._world.bodies, self._rotation())
        return self._plan_any(_above(self._position(name), height), rotations)

    def _move(self, position: Point, rotation: Rotation) -> JointTrajectory:
        """Plan a straight move to a pose, via home if the straight line is not feasible."""
        return self._plan_any(position, [rotation]).trajectory

    def _move_over(self, place: Point, height: float, rotation: Rotation) -> JointTrajectory:
        """Plan a straight move to a point over a place, m above the table."""
        return self._move(_above(place, height), rotation)

    def _plan_any(self, position: Point, rotations: Sequence[Rotation]) -> Approach:
        """Plan a move with the first of some rotations that the wrist can take.

        At the edge of the workspace the move ends up to 1 cm nearer to the robot; the full way is
        tried first, with every rotation.

        Raises:
            MotionPlanningError: none can be taken, not even nearer to the robot.
        """
        errors = []
        for shortfall, rotation in itertools.product(SHORTFALLS, rotations):
            goal = _towards_robot(position, shortfall)
            try:
                return Approach(self._plan(goal, rotation), rotation)
            except MotionPlanningError as error:
                errors.append(error)
        raise errors[len(rotations) - 1]  # of the place itself, with the last rotation

    def _plan(self, position: Point, rotation: Rotation) -> JointTrajectory:
        """Plan a move from where the arm is now, with the gripper as it is."""
        goal = ToolPose(np.asarray(position, dtype=np.float64), rotation)
        path = self._planner.plan_move(self._world.robot.arm_positions, goal)
        return with_gripper(path, self._gripper)

    def _position(self, name: str) -> Point:
        """Return where an object is now, world frame, m."""
        return self._world.bodies[name].position

    def _place(self, primitive: Primitive) -> Point:
        """Return the position of the place that a primitive ends at."""
        return self._position(str(primitive.place))

    def _rotation(self) -> Rotation:
        """Return the tool's current rotation."""
        return rotation_of(self._world.robot.tool_pose)


def _above(place: Point, height: float) -> Point:
    """Return the point over a place at a height above the table; the place's own is ignored."""
    return Point(place.x, place.y, height)


def _towards_robot(place: Point, distance: float) -> Point:
    """Return the place moved in the plane towards the robot's base by a distance, m."""
    x = place.x - ROBOT_BASE[0]
    y = place.y - ROBOT_BASE[1]
    share = distance / math.hypot(x, y)
    return Point(place.x - share * x, place.y - share * y, place.z)
