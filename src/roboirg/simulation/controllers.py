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
    from roboirg.simulation.expert.motion_planning import MotionPlanner, ToolPose
    from roboirg.simulation.world import World


class Controller(Protocol):
    """Converts validated actions of one action space to joint actions."""

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

    def __init__(self, _robot: Panda) -> None:
        pass

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


class WaypointController:
    """Moves the tool to poses in a straight line, then opens or closes the gripper."""

    def __init__(self, robot: Panda) -> None:
        self._robot = robot
        self._planner = _make_planner(robot)
        self._gripper = OPEN

    def trajectories(self, action: CheckedActions) -> Iterator[JointTrajectory]:
        """Yield the move with the gripper unchanged, then six steps if it opens or closes."""
        try:
            path = self._planner.plan_move(self._robot.arm_positions, tool_pose(action))
        except MotionPlanningError as error:
            raise MotionPlanningError(
                f"no straight move reaches {describe_pose(action)}"
            ) from error
        yield with_gripper(path, self._gripper)
        if action[POSE_SIZE] in (OPEN, CLOSED):
            self._gripper = float(action[POSE_SIZE])
            yield with_gripper(
                np.tile(self._robot.arm_positions, (GRIPPER_STEPS, 1)), self._gripper
            )


class ChoiceController:
    """Executes the scripted expert's motions by a task's choices, on what a point is nearest to."""

    def __init__(self, world: World, choices: Sequence[Choice]) -> None:
        from roboirg.simulation.expert.primitives import MotionPrimitives

        self._world, self._choices = world, choices
        self._expert = MotionPrimitives(world)

    def trajectories(self, action: CheckedActions) -> Iterator[JointTrajectory]:
        """Yield the trajectories of the motion; one control step at rest if it has none."""
        motion = self._motion(self._choices[int(action[0])], (round(action[1]), round(action[2])))
        if motion is None:
            yield np.append(self._world.robot.arm_positions, self._expert.gripper)[None]
            return
        yield from self._expert.execute(motion)

    def _motion(self, choice: Choice, point: tuple[int, int]) -> Primitive | None:
        """Return the motion of a choice; None if nothing is left to wait for or to point at."""
        from roboirg.simulation.expert.things import held_thing, nearest_thing, present_things

        world = self._world
        ahead = (one for one in choice.primitives if not 0 < one.steps <= world.elapsed)
        motion = next(ahead, None)
        if motion is None or choice.kind is None:
            meant = None if motion is None else motion.place
        elif (found := nearest_thing(present_things(world, (choice.kind,)), point)) is None:
            return None
        else:
            meant = found[0].item.name
        if motion is None or motion.kind in PICKS:
            return motion and motion._replace(subject=str(meant))
        if motion.kind in HANDLES_HELD:
            return motion._replace(subject=held_thing(world) or ROBOT, place=meant)
        return motion


def tool_pose(action: CheckedActions) -> ToolPose:
    """Return the pose of an action that starts with x, y, z, roll, pitch, yaw (extrinsic x-y-z)."""
    from scipy.spatial.transform import Rotation

    from roboirg.simulation.expert.motion_planning import ToolPose

    return ToolPose(action[:3], Rotation.from_euler("xyz", action[3:POSE_SIZE]))


def describe_pose(action: CheckedActions) -> str:
    """Return the pose of an action in words."""
    x, y, z, roll, pitch, yaw = (_format_number(number) for number in action[:POSE_SIZE])
    return f"({x}, {y}, {z}) with roll {roll}, pitch {pitch}, yaw {yaw}"


def _make_planner(robot: Panda) -> MotionPlanner:
    # Importing it takes a third of a second, and joint actions do not need it.
    from roboirg.simulation.expert.motion_planning import MotionPlanner

    return MotionPlanner(robot)


def _format_number(number: float) -> str:
    return f"{number:.3f}" if abs(number) < 1e6 else f"{number:.3e}"  # noqa: PLR2004


_CONTROLLERS: Mapping[str, Callable[[Panda], Controller]] = {
    JOINT_ANGLE.name: JointAngleController,
    EE_POSE.name: ToolPoseController,
    WAYPOINT.name: WaypointController,
}
