"""When the joints are where: a path through way points gets its timing, at the control rate.

As in RoboMME's planner (mplib) the path is a spline through joint positions a fixed distance apart,
run through as fast as speed and acceleration limits allow (TOPP-RA), with the spline's parameter
growing equally from each way point to the next. The last two are nearer to each other, so that
the spline bends there and the move takes 5 to 10 % longer than it would have to: these are the
lengths that policies trained on RoboMME's data have seen.
"""

from __future__ import annotations

import functools
from types import ModuleType

import numpy as np
from numpy.typing import NDArray

from roboirg.core.actions import ARM_JOINTS
from roboirg.core.errors import MotionPlanningError
from roboirg.simulation.physics_settings import CONTROL_PERIOD

JOINT_SPEED_LIMIT = 0.9
"""rad/s, every arm joint (RoboMME's planner)."""
JOINT_ACCELERATION_LIMIT = 0.9
"""rad/s^2, every arm joint."""
WAYPOINT_SPACING = 0.1
"""Radians between way points, as the norm over all joints."""
SMALLEST_JOINT_STEP = 1e-6
GRID_INTERVALS = 10
"""Into which the way between two way points is divided."""


def time_parameterize(points: NDArray[np.float64]) -> NDArray[np.float64]:
    """The fastest motion through way points within the joint limits, at the control rate.

    Args:
        points: (n, 7) joint positions, rad, close together.

    Returns:
        (m, 7) joint positions, one per control step, first and last way point included.

    Raises:
        MotionPlanningError: no timing was found.
    """
    points = _spaced(points)
    if len(points) == 1:
        return points
    toppra = _toppra()
    limits = np.ones(ARM_JOINTS)
    path = toppra.SplineInterpolator(np.linspace(0.0, 1.0, len(points)), points)
    constraints = [
        toppra.constraint.JointVelocityConstraint(limits * JOINT_SPEED_LIMIT),
        toppra.constraint.JointAccelerationConstraint(limits * JOINT_ACCELERATION_LIMIT),
    ]
    # Limits hold where the timing is computed: at every way point and nine places in between.
    grid = np.linspace(0.0, 1.0, GRID_INTERVALS * (len(points) - 1) + 1)
    solver = toppra.algorithm.TOPPRA(
        constraints, path, gridpoints=grid, parametrizer="ParametrizeConstAccel"
    )
    trajectory = solver.compute_trajectory()
    if trajectory is None:
        raise MotionPlanningError("No timing within the joint limits was found.")
    count = max(int(trajectory.duration / CONTROL_PERIOD), 2)
    return np.asarray(trajectory(np.linspace(0.0, trajectory.duration, count)))


@functools.cache
def _toppra() -> ModuleType:
    """The library, which takes half a second to import: it brings a plotting library."""
    import toppra
    import toppra.algorithm
    import toppra.constraint

    toppra.setup_logging("ERROR")
    module: ModuleType = toppra
    return module


def _spaced(points: NDArray[np.float64]) -> NDArray[np.float64]:
    """Points on the same path, a fixed distance apart; the last is nearer to the one before it."""
    lengths = np.linalg.norm(np.diff(points, axis=0), axis=1)
    path = np.concatenate([[0.0], np.cumsum(lengths)])
    marks = np.arange(0.0, path[-1] - SMALLEST_JOINT_STEP, WAYPOINT_SPACING)
    if len(marks) == 0:
        return points[:1]
    marks = np.append(marks, path[-1])
    joints = [np.interp(marks, path, points[:, joint]) for joint in range(points.shape[1])]
    return np.stack(joints, axis=1)
