"""From a policy's actions to what the joints do: one controller for each action space.

A controller gives joint actions piece by piece, as the oracle's hands do: the world has executed
one piece before the next is planned. Rules and step counts: RoboMME.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from typing import TYPE_CHECKING, Protocol

import numpy as np
from numpy.typing import NDArray

from roboirg.core.actions import EE_POSE, JOINT_ANGLE, POSE_SIZE, WAYPOINT, ActionSpace
from roboirg.core.errors import MotionPlanningError
from roboirg.simulation.panda import Panda
from roboirg.simulation.physics_settings import CLOSED, GRIPPER_STEPS, OPEN

if TYPE_CHECKING:
    from roboirg.simulation.expert.motion_planning import MotionPlanner, ToolPose

Piece = NDArray[np.float64]
"""Joint actions (n, 8), n >= 1: joint targets and the gripper."""


class Controller(Protocol):
    """Turns checked actions of one space into joint actions."""

    def pieces(self, action: NDArray[np.float64]) -> Iterator[Piece]:
        """The pieces of one action; take the next one when the last has been executed.

        Raises:
            MotionPlanningError: the pose cannot be reached; the message is a cause of failure.
        """


def make_controller(space: ActionSpace, robot: Panda) -> Controller:
    """A controller for one episode.

    Args:
        space: what the actions are.
        robot: whose joints are to move; its gripper counts as open.
    """
    return _CONTROLLERS[space.name](robot)


class JointAngles:
    """Joint targets, as they are."""

    def __init__(self, _robot: Panda) -> None:
        pass

    def pieces(self, action: NDArray[np.float64]) -> Iterator[Piece]:
        """One control step."""
        yield action[None]


class ToolPoses:
    """Poses of the tool, each by the nearest joint positions that have it."""

    def __init__(self, robot: Panda) -> None:
        self._robot = robot
        self._planner = _make_planner(robot)

    def pieces(self, action: NDArray[np.float64]) -> Iterator[Piece]:
        """One control step.

        Raises:
            MotionPlanningError: no joint positions have that pose.
        """
        try:
            arm = self._planner.inverse(self._robot.arm_positions, tool_pose(action))
        except MotionPlanningError as error:
            raise MotionPlanningError(f"no joint positions reach {in_words(action)}") from error
        yield np.append(arm, action[POSE_SIZE])[None]


class Waypoints:
    """Poses to which the tool moves in a straight line, with what the gripper does there."""

    def __init__(self, robot: Panda) -> None:
        self._robot = robot
        self._planner = _make_planner(robot)
        self._gripper = OPEN

    def pieces(self, action: NDArray[np.float64]) -> Iterator[Piece]:
        """The move with the gripper as it was, then six steps if it is to close or open.

        Raises:
            MotionPlanningError: the pose cannot be reached.
        """
        try:
            path = self._planner.travel(self._robot.arm_positions, tool_pose(action))
        except MotionPlanningError as error:
            raise MotionPlanningError(f"no straight move reaches {in_words(action)}") from error
        yield self._with_gripper(path)
        if action[POSE_SIZE] in (OPEN, CLOSED):
            self._gripper = float(action[POSE_SIZE])
            yield self._with_gripper(np.tile(self._robot.arm_positions, (GRIPPER_STEPS, 1)))

    def _with_gripper(self, joints: NDArray[np.float64]) -> Piece:
        return np.column_stack([joints, np.full(len(joints), self._gripper)])


def tool_pose(action: NDArray[np.float64]) -> ToolPose:
    """The pose in an action that begins with x, y, z, roll, pitch, yaw (extrinsic x-y-z)."""
    from scipy.spatial.transform import Rotation

    from roboirg.simulation.expert.motion_planning import ToolPose

    return ToolPose(action[:3], Rotation.from_euler("xyz", action[3:POSE_SIZE]))


def in_words(action: NDArray[np.float64]) -> str:
    """The same pose for people to read."""
    x, y, z, roll, pitch, yaw = (_short(number) for number in action[:POSE_SIZE])
    return f"({x}, {y}, {z}) with roll {roll}, pitch {pitch}, yaw {yaw}"


def _make_planner(robot: Panda) -> MotionPlanner:
    # It takes a third of a second to import, and who commands joints does not need it.
    from roboirg.simulation.expert.motion_planning import MotionPlanner

    return MotionPlanner(robot)


def _short(number: float) -> str:
    return f"{number:.3f}" if abs(number) < 1e6 else f"{number:.3e}"  # noqa: PLR2004


_CONTROLLERS: Mapping[str, Callable[[Panda], Controller]] = {
    JOINT_ANGLE.name: JointAngles,
    EE_POSE.name: ToolPoses,
    WAYPOINT.name: Waypoints,
}
