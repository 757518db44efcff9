"""Motion primitives that vary: other grasps and speeds, detours, and recoveries from a miss."""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from roboirg.core.errors import MotionPlanningError
from roboirg.core.motions import Point
from roboirg.simulation.expert.grasping import grasp_rotations
from roboirg.simulation.expert.motion_planning import ToolPose
from roboirg.simulation.expert.primitives import CUBE_HOVER, MotionPrimitives
from roboirg.simulation.panda import JointTrajectory
from roboirg.simulation.physics_settings import CLOSED
from roboirg.simulation.world import World

SLOWEST = 0.6
"""Smallest speed, as a share of the expert's."""
LARGEST_DETOUR = 0.05
"""Meters by which the middle of a move may lie aside."""
OTHER_GRASP = 0.5
"""Probability of a side other than the one that needs the shortest turn."""
MISS = 0.25
"""Probability that the first attempt to pick a cube closes above it."""
MISS_HEIGHT = 0.05
"""Meters above a cube's origin at which a grasp misses it."""
FREE_HEIGHT = 0.1
"""Tool height above which moves may leave the straight line."""
SHORTEST_DETOUR = 0.08
"""Meters of travel from which on a move may leave the straight line."""


class MotionVariation(NamedTuple):
    """How an episode differs from the expert's own way.

    Attributes:
        speed: of all moves, as a share of the expert's.
        detour: meters by which the middle of a move may lie aside.
        other_grasp: probability of another side.
        miss: probability of a missed first grasp.
    """

    speed: float
    detour: float
    other_grasp: float = OTHER_GRASP
    miss: float = MISS

    @classmethod
    def draw(cls, rng: np.random.Generator) -> MotionVariation:
        """Draw a speed and the size of detours."""
        return cls(float(rng.uniform(SLOWEST, 1.0)), float(rng.uniform(0.0, LARGEST_DETOUR)))


class VariedPrimitives(MotionPrimitives):
    """Executes primitives in one world with random variations."""

    def __init__(self, world: World, variation: MotionVariation, rng: np.random.Generator) -> None:
        super().__init__(world)
        self._variation, self._rng = variation, rng

    def _grasp_and_lift(self, cube: str, opening: float) -> Iterator[JointTrajectory]:
        if self._rng.random() < self._variation.miss:
            yield from self._miss(cube, opening)
        yield from super()._grasp_and_lift(cube, opening)

    def _miss(self, cube: str, opening: float) -> Iterator[JointTrajectory]:
        """Yield a grasp that closes above a cube, and the way back up."""
        yield self._grip(opening)
        approach, rotation = self._approach(cube, CUBE_HOVER)
        yield approach
        place = self._position(cube)
        above = place._replace(z=place.z + MISS_HEIGHT)
        yield self._move(above, rotation)
        yield self._grip(CLOSED)
        yield self._move(place._replace(z=CUBE_HOVER), rotation)

    def _approach(self, name: str, height: float) -> tuple[JointTrajectory, Rotation]:
        if self._rng.random() < self._variation.other_grasp:
            goal = self._position(name)._replace(z=height)
            # The sides that nothing blocks come first; the best of them is the usual one.
            others = grasp_rotations(name, self._world.bodies, self._rotation())[1:]
            try:
                return self._plan(goal, others[0]), others[0]
            except MotionPlanningError:
                pass  # a wrist limit; the usual side works
        return super()._approach(name, height)

    def _plan(self, position: Point, rotation: Rotation) -> JointTrajectory:
        start = self._world.robot.arm_positions
        goal = ToolPose(np.asarray(position, dtype=np.float64), rotation)
        try:
            path = self._plan_detour(start, goal)
        except MotionPlanningError:
            path = self._planner.plan_move(start, goal)
        return self._with_gripper(_slowed(path, self._variation.speed))

    def _plan_detour(self, start: NDArray[np.float64], goal: ToolPose) -> NDArray[np.float64]:
        """Plan a move whose middle lies aside, if it is long and high enough."""
        here = self._planner.forward_kinematics(start)
        travel = float(np.linalg.norm(goal.position - here.position))
        height = min(float(here.position[2]), float(goal.position[2]))
        if travel < SHORTEST_DETOUR or height < FREE_HEIGHT:
            return self._planner.plan_move(start, goal)
        aside = self._rng.uniform(-1.0, 1.0, 3) * self._variation.detour
        middle = (here.position + goal.position) / 2.0 + np.append(aside[:2], abs(aside[2]))
        first = self._planner.plan_straight(start, ToolPose(middle, goal.rotation))
        return np.concatenate([first, self._planner.plan_straight(first[-1], goal)[1:]])


def _slowed(path: NDArray[np.float64], speed: float) -> NDArray[np.float64]:
    """Return a joint path (n, 7) that takes 1 / speed times as long."""
    count = max(round(len(path) / speed), len(path))
    places = np.linspace(0.0, len(path) - 1.0, count)
    steps = np.arange(len(path))
    return np.stack([np.interp(places, steps, joint) for joint in path.T], axis=1)
