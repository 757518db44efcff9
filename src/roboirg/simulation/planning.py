"""Straight moves of the tool: inverse kinematics along a screw, time-optimal within limits.

A move is a straight line in SE(3) from the present tool pose to the wanted one. It is followed in
joint space by differential inverse kinematics, then given the fastest timing within joint speed
and acceleration limits (TOPP-RA), then sampled at the control rate. All of it is deterministic.
"""

from __future__ import annotations

import itertools
import math
from typing import NamedTuple

import numpy as np
import sapien
import toppra
import toppra.algorithm
import toppra.constraint
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from roboirg.actions import ARM_JOINTS
from roboirg.episode import ROBOT_BASE
from roboirg.errors import MotionPlanningError
from roboirg.simulation.robot import TOOL_LINK, Robot, rotation_of
from roboirg.simulation.settings import CONTROL_PERIOD

JOINT_SPEED_LIMIT = 0.9
"""rad/s, every arm joint (RoboMME's planner)."""
JOINT_ACCELERATION_LIMIT = 0.9
"""rad/s^2, every arm joint."""

WAYPOINT_DISTANCE = 0.02
"""Metres of tool travel between way points of a move."""
WAYPOINT_ANGLE = 0.05
"""Radians of tool rotation between way points."""
POSE_TOLERANCE = 1e-6
MAX_ITERATIONS = 20
DAMPING = 1e-6
SMALLEST_JOINT_STEP = 1e-9
LARGEST_JOINT_STEP = 0.35
"""Radians between way points above which the arm would swing round: no straight move."""

toppra.setup_logging("ERROR")


class ToolPose(NamedTuple):
    """Where the tool centre point is to be, world frame."""

    position: NDArray[np.float64]
    rotation: Rotation

    @classmethod
    def of(cls, pose: sapien.Pose) -> ToolPose:
        """From SAPIEN's pose."""
        return cls(np.asarray(pose.p, dtype=np.float64), rotation_of(pose))


class Planner:
    """Plans for one robot; keeps its kinematic model.

    Args:
        robot: whose joints are to move.
    """

    def __init__(self, robot: Robot) -> None:
        self._model = robot.articulation.create_pinocchio_model()
        names = [link.name for link in robot.articulation.links]
        self._tool = names.index(TOOL_LINK)
        limits = np.asarray(robot.articulation.get_qlimits(), dtype=np.float64)[:ARM_JOINTS]
        self._low, self._high = limits[:, 0], limits[:, 1]

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
        return timed(self._waypoints(arm, goal))

    def _waypoints(self, arm: NDArray[np.float64], goal: ToolPose) -> NDArray[np.float64]:
        start = self.forward(arm)
        turn = (start.rotation.inv() * goal.rotation).as_rotvec()
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
            current = self.forward(arm)
            error = np.concatenate(
                [
                    current.rotation.inv().apply(pose.position - current.position),
                    (current.rotation.inv() * pose.rotation).as_rotvec(),
                ]
            )
            if float(np.abs(error).max()) < POSE_TOLERANCE:
                return self._checked(arm, seed)
            jacobian = np.asarray(
                self._model.compute_single_link_local_jacobian(_with_fingers(arm), self._tool)
            )[:, :ARM_JOINTS]
            gain = jacobian @ jacobian.T + DAMPING * np.eye(6)
            arm = arm + jacobian.T @ np.linalg.solve(gain, error)
        raise MotionPlanningError(f"The arm cannot reach {_where(pose)} in a straight move.")

    def _checked(self, arm: NDArray[np.float64], seed: NDArray[np.float64]) -> NDArray[np.float64]:
        if bool(((arm < self._low) | (arm > self._high)).any()):
            raise MotionPlanningError("A straight move would exceed a joint limit.")
        if float(np.abs(arm - seed).max()) > LARGEST_JOINT_STEP:
            raise MotionPlanningError("A straight move passes too close to a singularity.")
        return arm


def timed(points: NDArray[np.float64]) -> NDArray[np.float64]:
    """The fastest motion through way points within the joint limits, at the control rate.

    Args:
        points: (n, 7) joint positions, rad.

    Returns:
        (m, 7) joint positions, one per control step, first and last way point included.

    Raises:
        MotionPlanningError: no timing was found.
    """
    lengths = np.linalg.norm(np.diff(points, axis=0), axis=1)
    moving = lengths > SMALLEST_JOINT_STEP
    if not moving.any():
        return points[:1]
    points = points[np.concatenate([[True], moving])]
    knots = np.concatenate([[0.0], np.cumsum(lengths[moving])])
    limits = np.ones(ARM_JOINTS)
    path = toppra.SplineInterpolator(knots, points)
    constraints = [
        toppra.constraint.JointVelocityConstraint(limits * JOINT_SPEED_LIMIT),
        toppra.constraint.JointAccelerationConstraint(limits * JOINT_ACCELERATION_LIMIT),
    ]
    solver = toppra.algorithm.TOPPRA(
        constraints, path, gridpoints=_grid(knots), parametrizer="ParametrizeConstAccel"
    )
    trajectory = solver.compute_trajectory()
    if trajectory is None:
        raise MotionPlanningError("No timing within the joint limits was found.")
    count = max(int(trajectory.duration / CONTROL_PERIOD), 2)
    return np.asarray(trajectory(np.linspace(0.0, trajectory.duration, count)))


def _grid(knots: NDArray[np.float64]) -> NDArray[np.float64]:
    """Where the timing is computed: every way point and nine places between two of them."""
    return np.concatenate(
        [np.linspace(low, high, 10, endpoint=False) for low, high in itertools.pairwise(knots)]
        + [knots[-1:]]
    )


def _with_fingers(arm: NDArray[np.float64]) -> NDArray[np.float64]:
    return np.append(arm, [0.0, 0.0])


def _where(pose: ToolPose) -> str:
    x, y, z = pose.position
    return f"({x:.3f}, {y:.3f}, {z:.3f})"
