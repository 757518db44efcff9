"""Straight moves of the tool, and joint positions for a pose. All of it is deterministic.

A move is a straight line in SE(3) from the present tool pose to the wanted one. It is followed in
joint space by differential inverse kinematics and then timed.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
import sapien
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from roboirg.core.actions import ARM_JOINTS
from roboirg.core.episode import ROBOT_BASE
from roboirg.core.errors import MotionPlanningError
from roboirg.simulation.expert.trajectory_timing import time_parameterize
from roboirg.simulation.panda import TOOL_LINK, Panda, rotation_of
from roboirg.simulation.physics_settings import HOME

WAYPOINT_DISTANCE = 0.02
"""Meters of tool travel between way points of a move."""
WAYPOINT_ANGLE = 0.05
"""Radians of tool rotation between way points."""
POSE_TOLERANCE = 1e-6
MAX_ITERATIONS = 20
DAMPING = 1e-6
LONGEST_TRAVEL = 3.0
"""Meters; nothing that far from the tool can be reached."""

INVERSE_TOLERANCE = 1e-3
"""Largest error, in meters and radians, of joint positions found for a pose (RoboMME)."""
INVERSE_ITERATIONS = 100
INVERSE_STARTS = 20
"""Joint positions from which a pose is tried: the present ones, home, and fixed others."""
LARGEST_NEWTON_ERROR = 0.3
"""Meters or radians of the pose error that one iteration looks at."""
LARGEST_NEWTON_STEP = 0.3
"""Radians."""

LARGEST_JOINT_STEP = 0.35
"""Radians between way points above which the arm would swing round: no straight move."""


class ToolPose(NamedTuple):
    """Where the tool center point is to be, world frame."""

    position: NDArray[np.float64]
    rotation: Rotation

    @classmethod
    def of(cls, pose: sapien.Pose) -> ToolPose:
        """From SAPIEN's pose."""
        return cls(np.asarray(pose.p, dtype=np.float64), rotation_of(pose))


class MotionPlanner:
    """Plans for one robot; keeps its kinematic model.

    Args:
        robot: whose joints are to move.
    """

    def __init__(self, robot: Panda) -> None:
        self._model = robot.articulation.create_pinocchio_model()
        names = [link.name for link in robot.articulation.links]
        self._tool = names.index(TOOL_LINK)
        limits = np.asarray(robot.articulation.get_qlimits(), dtype=np.float64)[:ARM_JOINTS]
        self._low, self._high = limits[:, 0], limits[:, 1]
        anywhere = np.random.default_rng(0).random((INVERSE_STARTS - 2, ARM_JOINTS))
        self._other_starts = self._low + anywhere * (self._high - self._low)

    def forward(self, arm: NDArray[np.float64]) -> ToolPose:
        """Pose of the tool for arm joint positions (7)."""
        self._model.compute_forward_kinematics(_with_fingers(arm))
        pose = ToolPose.of(self._model.get_link_pose(self._tool))
        return ToolPose(pose.position + ROBOT_BASE, pose.rotation)

    def straight(self, arm: NDArray[np.float64], goal: ToolPose) -> NDArray[np.float64]:
        """Joint positions, one row per control step, that move the tool straight to `goal`.

        Args:
            arm: joint positions (7) at the start, rad.
            goal: where the tool shall end.

        Returns:
            Shape (n, 7), n >= 1, from the start to the end, both included.

        Raises:
            MotionPlanningError: the line leaves the joint limits or cannot be followed.
        """
        return time_parameterize(self._waypoints(arm, goal))

    def travel(self, arm: NDArray[np.float64], goal: ToolPose) -> NDArray[np.float64]:
        """As `straight`; by way of home where the straight line is not feasible.

        Raises:
            MotionPlanningError: the goal cannot be reached from home either.
        """
        try:
            return self.straight(arm, goal)
        except MotionPlanningError:
            home = time_parameterize(np.linspace(arm, HOME, 10))
            return np.concatenate([home, self.straight(HOME, goal)])

    def inverse(self, arm: NDArray[np.float64], goal: ToolPose) -> NDArray[np.float64]:
        """Joint positions (7) within the limits that put the tool at a pose.

        Those found from `arm`, so that a near pose needs small movements; if there are none, those
        found from home or else from one of eighteen fixed places.

        Args:
            arm: joint positions (7), rad.
            goal: where the tool shall be, within 1e-3 m and rad on every axis.

        Raises:
            MotionPlanningError: none were found.
        """
        for start in (arm, HOME, *self._other_starts):
            found = self._descend(start, goal)
            if found is not None:
                return found
        raise MotionPlanningError(f"No joint positions reach {_where(goal)}.")

    def _descend(self, start: NDArray[np.float64], goal: ToolPose) -> NDArray[np.float64] | None:
        """Joint positions for a pose by damped Newton steps within the limits; None if it fails."""
        arm = np.clip(start, self._low, self._high)
        error = self._error(arm, goal)
        for _ in range(INVERSE_ITERATIONS):
            if float(np.abs(error).max()) < POSE_TOLERANCE:
                break
            near = np.clip(error, -LARGEST_NEWTON_ERROR, LARGEST_NEWTON_ERROR)
            step = self._step_within_limits(arm, near)
            largest = float(np.abs(step).max())
            if largest > LARGEST_NEWTON_STEP:
                step *= LARGEST_NEWTON_STEP / largest
            arm = np.clip(arm + step, self._low, self._high)
            error = self._error(arm, goal)
        return arm if float(np.abs(error).max()) <= INVERSE_TOLERANCE else None

    def _step_within_limits(
        self, arm: NDArray[np.float64], error: NDArray[np.float64]
    ) -> NDArray[np.float64]:
        """The step of `_step` made by the joints that are not held back by a limit."""
        free = np.ones(ARM_JOINTS, dtype=bool)
        step = self._step(arm, error)
        for _ in range(ARM_JOINTS):
            held = ((arm <= self._low) & (step < 0.0)) | ((arm >= self._high) & (step > 0.0))
            if not bool((held & free).any()):
                break
            free &= ~held
            step = self._step(arm, error, free)
        return step

    def _step(
        self,
        arm: NDArray[np.float64],
        error: NDArray[np.float64],
        free: NDArray[np.bool_] | None = None,
    ) -> NDArray[np.float64]:
        """The smallest change of the (free) joints that mends a small error of the tool's pose."""
        jacobian = np.asarray(
            self._model.compute_single_link_local_jacobian(_with_fingers(arm), self._tool)
        )[:, :ARM_JOINTS]
        if free is not None:
            jacobian = jacobian * free
        gain = jacobian @ jacobian.T + DAMPING * np.eye(6)
        return np.asarray(jacobian.T @ np.linalg.solve(gain, error))

    def _error(self, arm: NDArray[np.float64], goal: ToolPose) -> NDArray[np.float64]:
        """What is missing to a pose (6): meters, then radians, in the tool's frame."""
        current = self.forward(arm)
        # Far is far: huge numbers would overflow.
        offset = np.clip(goal.position - current.position, -LONGEST_TRAVEL, LONGEST_TRAVEL)
        back = current.rotation.inv()
        return np.concatenate([back.apply(offset), (back * goal.rotation).as_rotvec()])

    def _waypoints(self, arm: NDArray[np.float64], goal: ToolPose) -> NDArray[np.float64]:
        start = self.forward(arm)
        turn = (start.rotation.inv() * goal.rotation).as_rotvec()
        if float(np.abs(goal.position - start.position).max()) > LONGEST_TRAVEL:
            raise MotionPlanningError(f"{_where(goal)} is out of reach.")
        travel = float(np.linalg.norm(goal.position - start.position))
        count = max(
            1,
            math.ceil(travel / WAYPOINT_DISTANCE),
            math.ceil(float(np.linalg.norm(turn)) / WAYPOINT_ANGLE),
        )
        points = [arm]
        for share in np.linspace(0.0, 1.0, count + 1)[1:]:
            pose = ToolPose(
                start.position + share * (goal.position - start.position),
                start.rotation * Rotation.from_rotvec(share * turn),
            )
            points.append(self._solve(pose, points[-1]))
        return np.stack(points)

    def _solve(self, pose: ToolPose, seed: NDArray[np.float64]) -> NDArray[np.float64]:
        """The joint positions nearest to `seed` that put the tool at `pose` (damped Newton)."""
        arm = seed.copy()
        for _ in range(MAX_ITERATIONS):
            error = self._error(arm, pose)
            if float(np.abs(error).max()) < POSE_TOLERANCE:
                return self._checked(arm, seed)
            arm = arm + self._step(arm, error)
        raise MotionPlanningError(f"The arm cannot reach {_where(pose)} in a straight move.")

    def _checked(self, arm: NDArray[np.float64], seed: NDArray[np.float64]) -> NDArray[np.float64]:
        if bool(((arm < self._low) | (arm > self._high)).any()):
            raise MotionPlanningError("A straight move would exceed a joint limit.")
        if float(np.abs(arm - seed).max()) > LARGEST_JOINT_STEP:
            raise MotionPlanningError("A straight move passes too close to a singularity.")
        return arm


def _with_fingers(arm: NDArray[np.float64]) -> NDArray[np.float64]:
    return np.append(arm, [0.0, 0.0])


def _where(pose: ToolPose) -> str:
    x, y, z = pose.position
    return f"({x:.3f}, {y:.3f}, {z:.3f})"
