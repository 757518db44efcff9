"""Time-parameterize a joint path (TOPP-RA) at the control rate.

As in RoboMME's planner (mplib), the path is a spline through joint positions a fixed distance
apart, traversed as fast as speed and acceleration limits allow, with the same increase of the
spline parameter between all neighboring waypoints. The last two are closer together, so the spline
bends there and the move takes 5 to 10 % longer than necessary: policies trained on RoboMME's data
have seen these durations.
"""

from __future__ import annotations

import functools
from types import ModuleType
from typing import Any

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
"""Radians between waypoints, as the norm over all joints."""
SMALLEST_JOINT_STEP = 1e-6
GRID_INTERVALS = 10
"""Grid intervals between two waypoints."""
PARAMETER_LENGTHS = (1.0, 0.1, 0.01, 0.001)
"""Lengths of the spline's parameter, tried in turn: TOPP-RA finds no timing for many paths that are
short compared with it, as those of a tool that stays where it is."""


def time_parameterize(points: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the fastest motion through waypoints within the joint limits, at the control rate.

    Args:
        points: (n, 7) joint positions, rad, close together.

    Returns:
        (m, 7) joint positions, one per control step, first and last waypoint included.

    Raises:
        MotionPlanningError: no timing was found.
    """
    waypoints = _resample(points)
    if len(waypoints) == 1:
        return waypoints
    for length in PARAMETER_LENGTHS:
        trajectory = _fastest(waypoints, length)
        if trajectory is not None:
            count = max(int(trajectory.duration / CONTROL_PERIOD), 2)
            times = np.linspace(0.0, trajectory.duration, count)
            return np.asarray(trajectory(times))
    raise MotionPlanningError("No timing within the joint limits was found.")


def _fastest(waypoints: NDArray[np.float64], length: float) -> Any:  # noqa: ANN401
    """Return TOPP-RA's fastest trajectory through waypoints; None if it finds none.

    Args:
        waypoints: (n, 7) joint positions, rad.
        length: of the spline's parameter.
    """
    toppra = _toppra()
    limits = np.ones(ARM_JOINTS)
    constraints = [
        toppra.constraint.JointVelocityConstraint(limits * JOINT_SPEED_LIMIT),
        toppra.constraint.JointAccelerationConstraint(limits * JOINT_ACCELERATION_LIMIT),
    ]
    parameters = np.linspace(0.0, length, len(waypoints))
    path = toppra.SplineInterpolator(parameters, waypoints)
    # Limits hold at the grid points: every waypoint and nine points in between.
    grid = np.linspace(0.0, length, GRID_INTERVALS * (len(waypoints) - 1) + 1)
    solver = toppra.algorithm.TOPPRA(
        constraints, path, gridpoints=grid, parametrizer="ParametrizeConstAccel"
    )
    return solver.compute_trajectory()


@functools.cache
def _toppra() -> ModuleType:
    """Import toppra, which takes half a second because it loads a plotting library."""
    import toppra
    import toppra.algorithm
    import toppra.constraint

    toppra.setup_logging("ERROR")
    module: ModuleType = toppra
    return module


def _resample(points: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return points on a path `WAYPOINT_SPACING` apart; the last is closer to the one before it.

    A path that goes nowhere is one point.

    Args:
        points: (n, 7) joint positions, rad, between which the path is straight.
    """
    steps = np.linalg.norm(np.diff(points, axis=0), axis=1)
    distances = np.concatenate([[0.0], np.cumsum(steps)])  # along the path, from its start
    total = distances[-1]
    wanted = np.arange(0.0, total - SMALLEST_JOINT_STEP, WAYPOINT_SPACING)
    if len(wanted) == 0:
        return points[:1]
    wanted = np.append(wanted, total)
    joints = [np.interp(wanted, distances, positions) for positions in points.T]
    return np.stack(joints, axis=1)
