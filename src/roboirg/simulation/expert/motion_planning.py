"""Motion planning: straight moves of the tool and inverse kinematics, all deterministic.

Forward kinematics gives the tool's pose for joint positions; inverse kinematics the other way
around, here by Newton steps, each of which corrects most of the error that is left. A move follows
a straight line from the tool's pose to the goal, position and rotation alike, at waypoints close to
each other; `trajectory_timing` turns them into control steps.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from roboirg.core.actions import ARM_JOINTS
from roboirg.core.episode import ROBOT_BASE
from roboirg.core.errors import MotionPlanningError
from roboirg.simulation.expert.trajectory_timing import time_parameterize
from roboirg.simulation.panda import TOOL_LINK, Panda, rotation_of
from roboirg.simulation.physics_settings import HOME

WAYPOINT_DISTANCE = 0.02
"""Meters of tool travel between waypoints of a move."""
WAYPOINT_ANGLE = 0.05
"""Radians of tool rotation between waypoints."""
POSE_TOLERANCE = 1e-6
MAX_ITERATIONS = 20
DAMPING = 1e-6
MAX_TRAVEL = 3.0
"""Meters; poses farther from the tool cannot be reached."""

INVERSE_TOLERANCE = 1e-3
"""Largest error, in meters and radians, of joint positions found for a pose (RoboMME)."""
INVERSE_ITERATIONS = 100
INVERSE_STARTS = 20
"""Initial joint positions to try: the current ones, home, and fixed others."""
MAX_NEWTON_ERROR = 0.3
"""Meters or radians to which one iteration clips the pose error."""
MAX_NEWTON_STEP = 0.3
"""Radians."""

MAX_JOINT_STEP = 0.35
"""Radians between waypoints; above this the arm would swing around."""

POSE_ERROR_SIZE = 6
Vector = NDArray[np.float64]
"""Arm joint positions (7,) in radians, a position (3,) or a pose error (6,); several are rows."""


class ToolPose(NamedTuple):
    """A pose of the tool center point, world frame."""

    position: Vector
    rotation: Rotation


class MotionPlanner:
    """Motion planner of one robot; it computes, and moves nothing."""

    def __init__(self, robot: Panda) -> None:
        self._model = robot.articulation.create_pinocchio_model()
        names = [link.name for link in robot.articulation.links]
        self._tool = names.index(TOOL_LINK)
        limits = np.asarray(robot.articulation.get_qlimits(), dtype=np.float64)
        self._low = limits[:ARM_JOINTS, 0]
        self._high = limits[:ARM_JOINTS, 1]
        shares = np.random.default_rng(0).random((INVERSE_STARTS - 2, ARM_JOINTS))
        self._other_starts = self._low + shares * (self._high - self._low)

    def forward_kinematics(self, arm: Vector) -> ToolPose:
        """Return the tool pose in the world frame at arm joint positions (7), rad."""
        self._model.compute_forward_kinematics(_with_fingers(arm))
        pose = self._model.get_link_pose(self._tool)
        return ToolPose(np.asarray(pose.p, dtype=np.float64) + ROBOT_BASE, rotation_of(pose))

    def plan_straight(self, arm: Vector, goal: ToolPose) -> Vector:
        """Plan a straight move of the tool to `goal`.

        Args:
            arm: joint positions (7) at the start, rad.
            goal: tool pose at the end.

        Returns:
            Joint positions (n, 7), n >= 1, one row per control step, start and end included.
        """
        return time_parameterize(self._waypoints(arm, goal))

    def plan_move(self, arm: Vector, goal: ToolPose) -> Vector:
        """Plan as `plan_straight`, but via home if the straight line is not feasible.

        Raises:
            MotionPlanningError: it is not feasible from home either.
        """
        try:
            return self.plan_straight(arm, goal)
        except MotionPlanningError:
            home = time_parameterize(np.linspace(arm, HOME, 10))
            return np.concatenate([home, self.plan_straight(HOME, goal)])

    def inverse_kinematics(self, arm: Vector, goal: ToolPose) -> Vector:
        """Return joint positions (7) within the limits that reach a tool pose.

        Starts the search from `arm`, so that a near pose needs small movements; if that fails,
        from home, then from eighteen fixed positions.

        Args:
            arm: joint positions (7), rad.
            goal: tool pose to reach, within 1e-3 m and rad on every axis.

        Raises:
            MotionPlanningError: no solution was found.
        """
        for start in (arm, HOME, *self._other_starts):
            found = self._solve_within_limits(start, goal)
            if found is not None:
                return found
        raise MotionPlanningError(f"No joint positions reach {_format_position(goal)}.")

    def _solve_within_limits(self, start: Vector, goal: ToolPose) -> Vector | None:
        """Return joint positions (7) that reach a pose, or None if they are not found.

        Damped Newton steps from a start, clipped to the joint limits.
        """
        arm = np.clip(start, self._low, self._high)
        error = self._pose_error(arm, goal)
        for _ in range(INVERSE_ITERATIONS):
            if _largest(error) < POSE_TOLERANCE:
                break
            clipped_error = np.clip(error, -MAX_NEWTON_ERROR, MAX_NEWTON_ERROR)
            step = self._limited_newton_step(arm, clipped_error)
            largest = _largest(step)
            if largest > MAX_NEWTON_STEP:
                step *= MAX_NEWTON_STEP / largest
            arm = np.clip(arm + step, self._low, self._high)
            error = self._pose_error(arm, goal)
        if _largest(error) > INVERSE_TOLERANCE:
            return None
        return arm

    def _limited_newton_step(self, arm: Vector, error: Vector) -> Vector:
        """Return a Newton step (7) of the joints that are not blocked by a limit.

        A joint is blocked if it is at a limit and the step would leave it. Without the blocked
        joints the others move farther, which can block some of them as well.
        """
        is_free = np.ones(ARM_JOINTS, dtype=bool)
        step = self._newton_step(arm, error)
        for _ in range(ARM_JOINTS):
            leaves_below = (arm <= self._low) & (step < 0.0)
            leaves_above = (arm >= self._high) & (step > 0.0)
            is_blocked = leaves_below | leaves_above
            if not bool((is_blocked & is_free).any()):
                break
            is_free &= ~is_blocked
            step = self._newton_step(arm, error, is_free)
        return step

    def _newton_step(
        self, arm: Vector, error: Vector, is_free: NDArray[np.bool_] | None = None
    ) -> Vector:
        """Return the smallest change (7) of the joints, rad, that corrects a small pose error.

        It is Jᵀ (J Jᵀ + damping)⁻¹ error, with the Jacobian J of the tool's pose.

        Args:
            arm: joint positions (7), rad.
            error: as of `_pose_error`.
            is_free: joints that may change; None for all.
        """
        joints = _with_fingers(arm)
        jacobian = np.asarray(self._model.compute_single_link_local_jacobian(joints, self._tool))
        jacobian = jacobian[:, :ARM_JOINTS]
        if is_free is not None:
            jacobian = jacobian * is_free
        gain = jacobian @ jacobian.T + DAMPING * np.eye(POSE_ERROR_SIZE)
        return np.asarray(jacobian.T @ np.linalg.solve(gain, error))

    def _pose_error(self, arm: Vector, goal: ToolPose) -> Vector:
        """Return the error to a pose (6) in the tool's frame: position, m, rotation vector, rad.

        It is what the tool still has to move to reach the goal.
        """
        current = self.forward_kinematics(arm)
        # Clipped, because huge offsets would overflow.
        offset = np.clip(goal.position - current.position, -MAX_TRAVEL, MAX_TRAVEL)
        to_tool = current.rotation.inv()
        turn = to_tool * goal.rotation
        return np.concatenate([to_tool.apply(offset), turn.as_rotvec()])

    def _waypoints(self, arm: Vector, goal: ToolPose) -> Vector:
        """Return joint positions (n, 7) along a straight line of the tool, its ends included.

        Position and rotation change by the same share from one to the next, at most by
        `WAYPOINT_DISTANCE` and `WAYPOINT_ANGLE`.
        """
        start = self.forward_kinematics(arm)
        offset = goal.position - start.position
        if _largest(offset) > MAX_TRAVEL:
            raise MotionPlanningError(f"{_format_position(goal)} is out of reach.")
        turn = (start.rotation.inv() * goal.rotation).as_rotvec()
        points = [arm]
        for share in np.linspace(0.0, 1.0, _move_count(offset, turn) + 1)[1:]:
            position = start.position + share * offset
            rotation = start.rotation * Rotation.from_rotvec(share * turn)
            points.append(self._solve_near(ToolPose(position, rotation), points[-1]))
        return np.stack(points)

    def _solve_near(self, pose: ToolPose, seed: Vector) -> Vector:
        """Return the joint positions (7) near `seed` that reach `pose`, by damped Newton steps.

        Raises:
            MotionPlanningError: there are none so near, or the way there is not straight.
        """
        arm = seed.copy()
        for _ in range(MAX_ITERATIONS):
            error = self._pose_error(arm, pose)
            if _largest(error) < POSE_TOLERANCE:
                return self._check_step(arm, seed)
            arm = arm + self._newton_step(arm, error)
        raise MotionPlanningError(
            f"The arm cannot reach {_format_position(pose)} in a straight move."
        )

    def _check_step(self, arm: Vector, seed: Vector) -> Vector:
        """Return the joint positions of a waypoint, if the arm can go there from the one before.

        Args:
            arm: joint positions (7) of the waypoint.
            seed: those of the one before it.

        Raises:
            MotionPlanningError: a joint would exceed its limit, or swing around.
        """
        if bool(((arm < self._low) | (arm > self._high)).any()):
            raise MotionPlanningError("A straight move would exceed a joint limit.")
        if _largest(arm - seed) > MAX_JOINT_STEP:
            raise MotionPlanningError("A straight move passes too close to a singularity.")
        return arm


def _move_count(offset: Vector, turn: Vector) -> int:
    """Return in how many moves the tool is shifted (m) and turned (a rotation vector, rad)."""
    by_distance = math.ceil(float(np.linalg.norm(offset)) / WAYPOINT_DISTANCE)
    by_angle = math.ceil(float(np.linalg.norm(turn)) / WAYPOINT_ANGLE)
    return max(1, by_distance, by_angle)


def _largest(vector: Vector) -> float:
    """Return the largest absolute value in a vector."""
    return float(np.abs(vector).max())


def _with_fingers(arm: Vector) -> Vector:
    """Return the robot's joint positions (9) for those of the arm, with closed fingers."""
    return np.append(arm, [0.0, 0.0])


def _format_position(pose: ToolPose) -> str:
    """Return a position for messages: "(0.100, 0.000, 0.150)"."""
    x, y, z = pose.position
    return f"({x:.3f}, {y:.3f}, {z:.3f})"
