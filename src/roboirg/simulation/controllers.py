"""Controllers: convert actions of each action space to joint actions.

Like the scripted expert, a controller yields one joint trajectory at a time; the world executes it
before the next is planned. Rules and step counts follow RoboMME.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from typing import TYPE_CHECKING, Protocol

import numpy as np

from roboirg.core.actions import (
    CHOICE,
    EE_POSE,
    JOINT_ANGLE,
    POSE_SIZE,
    WAYPOINT,
    ActionSpace,
    CheckedActions,
)
from roboirg.core.choices import Choice
from roboirg.core.episode import HANDLES_HELD, PICKS, ROBOT, Primitive
from roboirg.core.errors import MotionPlanningError
from roboirg.simulation.panda import JointTrajectory, Panda, with_gripper
from roboirg.simulation.physics_settings import CLOSED, GRIPPER_STEPS, OPEN

if TYPE_CHECKING:
    from roboirg.core.subgoal_text import Point
    from roboirg.simulation.expert.motion_planning import MotionPlanner, ToolPose
    from roboirg.simulation.world import World

LONG_NUMBER = 1e6
"""From here on, messages give numbers with an exponent."""


class Controller(Protocol):
    """Converts validated actions of one action space to joint actions: targets (8), one a step."""

    def trajectories(self, action: CheckedActions) -> Iterator[JointTrajectory]:
        """Yield the trajectories of one action; take the next after executing the last.

        Raises:
            MotionPlanningError: the pose cannot be reached; the message is the cause of failure.
        """


def make_controller(space: ActionSpace, world: World, choices: Sequence[Choice] = ()) -> Controller:
    """Create a controller for one episode; the robot's gripper is assumed to be open.

    Args:
        space: of the actions.
        world: in which they are executed.
        choices: of the task, for actions in `CHOICE`.
    """
    if space is CHOICE:
        return ChoiceController(world, choices)
    return _CONTROLLERS[space.name](world.robot)


class JointAngleController:
    """Passes joint targets through unchanged."""

    def __init__(self, robot: Panda) -> None:
        del robot

    def trajectories(self, action: CheckedActions) -> Iterator[JointTrajectory]:
        """Yield one control step."""
        yield action[None]


class ToolPoseController:
    """Reaches tool poses in one control step by inverse kinematics."""

    def __init__(self, robot: Panda) -> None:
        self._robot = robot
        self._planner = _make_planner(robot)

    def trajectories(self, action: CheckedActions) -> Iterator[JointTrajectory]:
        """Yield one control step."""
        try:
            arm = self._planner.inverse_kinematics(self._robot.arm_positions, tool_pose(action))
        except MotionPlanningError as error:
            raise MotionPlanningError(
                f"no joint positions reach {describe_pose(action)}"
            ) from error
        yield np.append(arm, action[POSE_SIZE])[None]


class WaypointController(ToolPoseController):
    """Moves the tool to poses in a straight line, then opens or closes the gripper."""

    _gripper = OPEN
    """The gripper action of the last waypoint that opened or closed it."""

    def trajectories(self, action: CheckedActions) -> Iterator[JointTrajectory]:
        """Yield the move with the gripper unchanged, then six steps if it opens or closes."""
        try:
            path = self._planner.plan_move(self._robot.arm_positions, tool_pose(action))
        except MotionPlanningError as error:
            raise MotionPlanningError(
                f"no straight move reaches {describe_pose(action)}"
            ) from error
        yield with_gripper(path, self._gripper)
        gripper = float(action[POSE_SIZE])
        if gripper in (OPEN, CLOSED):
            self._gripper = gripper
            at_rest = np.tile(self._robot.arm_positions, (GRIPPER_STEPS, 1))
            yield with_gripper(at_rest, gripper)


class ChoiceController:
    """Executes the scripted expert's motions: an action is the number of a choice, and a point.

    The choice says what is done, and the object of its kind nearest to the point with what.

    Args:
        world: in which they are executed.
        choices: of the task.
    """

    def __init__(self, world: World, choices: Sequence[Choice]) -> None:
        from roboirg.simulation.expert.primitives import MotionPrimitives

        self._world = world
        self._choices = choices
        self._expert = MotionPrimitives(world)

    def trajectories(self, action: CheckedActions) -> Iterator[JointTrajectory]:
        """Yield joint trajectories (n, 8), one after the other, that carry out a choice.

        If there is nothing to do (`_motion`), the robot rests for one control step. Each trajectory
        is planned from where the robot is when it is asked for, so execute one before the next.

        Args:
            action: (3,) number of the choice, row and column: ``[2, 110, 84]`` is the third choice
                with the object nearest to row 110 and column 84 of the front picture.
        """
        number, row, column = action
        choice = self._choices[int(number)]
        point = (round(row), round(column))
        motion = self._motion(choice, point)
        if motion is not None:
            yield from self._expert.execute(motion)
            return
        yield np.append(self._world.robot.arm_positions, self._expert.gripper)[None]

    def _motion(self, choice: Choice, point: Point) -> Primitive | None:
        """Return the motion of a choice, with its object; None if there is nothing to do.

        There is none if the time of all its motions has passed, or if the picture has no object of
        its kind.

        Args:
            choice: its motion lacks the object, which is the one of its kind nearest to the point.
            point: row and column in the front picture.
        """
        from roboirg.simulation.expert.things import held_thing, nearest_thing, present_things

        motion = self._first_ahead(choice)
        if motion is None:
            return None
        meant = motion.place
        if choice.kind is not None:
            things = present_things(self._world, (choice.kind,))
            nearest = nearest_thing(things, point)
            if nearest is None:
                return None
            meant = nearest.thing.item.name
        if motion.kind in PICKS:
            return motion._replace(subject=str(meant))
        if motion.kind in HANDLES_HELD:
            return motion._replace(subject=held_thing(self._world) or ROBOT, place=meant)
        return motion

    def _first_ahead(self, choice: Choice) -> Primitive | None:
        """Return the first motion of a choice whose time has not passed; None if all are past."""
        for motion in choice.primitives:
            is_past = 0 < motion.steps <= self._world.elapsed  # 0: it has no time
            if not is_past:
                return motion
        return None


def tool_pose(action: CheckedActions) -> ToolPose:
    """Return the pose of an action that starts with x, y, z, roll, pitch, yaw (extrinsic x-y-z)."""
    from scipy.spatial.transform import Rotation

    from roboirg.simulation.expert.motion_planning import ToolPose

    return ToolPose(action[:3], Rotation.from_euler("xyz", action[3:POSE_SIZE]))


def describe_pose(action: CheckedActions) -> str:
    """Return the pose of an action in words: "(0.1, …) with roll 3.142, pitch 0.000, yaw …"."""
    numbers = [_format_number(number) for number in action[:POSE_SIZE]]
    x, y, z, roll, pitch, yaw = numbers
    return f"({x}, {y}, {z}) with roll {roll}, pitch {pitch}, yaw {yaw}"


def _make_planner(robot: Panda) -> MotionPlanner:
    """Return the motion planner of a robot."""
    # Importing it takes a third of a second, and joint actions do not need it.
    from roboirg.simulation.expert.motion_planning import MotionPlanner

    return MotionPlanner(robot)


def _format_number(number: float) -> str:
    """Return a number with three digits after the point: "0.123", "1.000e+06"."""
    if abs(number) < LONG_NUMBER:
        return f"{number:.3f}"
    return f"{number:.3e}"


_CONTROLLERS: Mapping[str, Callable[[Panda], Controller]] = {
    JOINT_ANGLE.name: JointAngleController,
    EE_POSE.name: ToolPoseController,
    WAYPOINT.name: WaypointController,
}
