"""The scripted expert in waypoints, disturbed on the way, for demonstrations that show recovery.

A *waypoint* is an action (7,): tool position x, y, z (meters, world frame), Euler angles x, y, z
(radians) and the gripper value. A *label* is what the undisturbed expert would have done instead of
the action that was executed; a policy learns the labels.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING, Any, ClassVar, NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from roboirg.core.actions import (
    ARM_JOINTS,
    JOINT_ANGLE,
    POSE_SIZE,
    WAYPOINT,
    Actions,
    CheckedActions,
)
from roboirg.core.episode import HANDLES_HELD, Goal
from roboirg.core.observations import Observation
from roboirg.policies.builtin.oracle_policy import OraclePolicy
from roboirg.simulation.controllers import WaypointController
from roboirg.simulation.expert.primitives import MotionPrimitives
from roboirg.simulation.physics_settings import CLOSED, GRIPPER_STEPS, OPEN

if TYPE_CHECKING:
    from roboirg.envs.environment import RoboIRGEnv
    from roboirg.simulation.panda import JointTrajectory

LEAVE = 0.0
"""Gripper value of a waypoint to which only the tool moves; the gripper stays as it is."""
STILL = 1e-4
"""Radians; a trajectory whose joints stay within this of their start moves only the gripper."""
WAIT_STEPS = GRIPPER_STEPS + 1
"""Control steps of a waypoint at which the gripper stays as it is, but is opened or closed."""
ON_THING = 0.012
"""Meters in the plane within which a waypoint counts as at an object; some end short of it."""
FREE_HEIGHT = 0.09
"""Tool height above which a disturbed waypoint touches nothing, m."""
UP = 0.05
"""Meters that a move straight up rises, at least."""
ASIDE = 0.06
"""Meters that it goes aside, at most."""
_TURNS = {"pick_cube": "align", "pick_container": "align", "press": "home", "hover": "home"}
"""How the tool turns when it moves to the object of a motion; else it keeps its angle."""
_YAW = 5
"""Index of the angle about the vertical in a waypoint."""


class Disturbance(NamedTuple):
    """How often and how far executed waypoints lie from the expert's, at random.

    Attributes:
        free: probability that a waypoint in free space is moved.
        plane: standard deviation of that displacement in x and y, m.
        height: its standard deviation in z, m.
        turn: its standard deviation about the vertical, rad.
        low: probability that a grasp or placement is moved, far enough to miss at times.
        miss: standard deviation of that displacement in x and y, m.
        stall: probability that a move is not made: the tool stays where it is, and the same move
            comes next.
    """

    free: float = 0.5
    plane: float = 0.015
    height: float = 0.01
    turn: float = 0.2
    low: float = 0.12
    miss: float = 0.025
    stall: float = 0.06


class ExpertWaypoint(NamedTuple):
    """One decision of the expert.

    Attributes:
        action: (7,) the waypoint, undisturbed.
        anchor: name of the object that the waypoint is at; None for one in free space, or where
            the tool is already.
        turn: how the tool turns on the way: ``keep`` its angle, ``align`` with the anchor, or
            ``home``, to the angle at the start of the episode.
    """

    action: CheckedActions
    anchor: str | None = None
    turn: str = "keep"


class WaypointExpert(OraclePolicy):
    """Executes the true goal in waypoints, some of them disturbed.

    Privileged. After a disturbance the expert goes on from where things are, so that its decisions
    show how to recover; what has failed is tried again.

    Attributes:
        last: the decision behind the action that `act` has returned last.
        labels: (1, 7) what the undisturbed expert would have done instead of that action: the same,
            unless it is disturbed, or the gripper opens or closes after a disturbed move.
    """

    actions: ClassVar[str] = WAYPOINT.name
    last: ExpertWaypoint
    labels: CheckedActions

    def __init__(self, seed: int = 0, disturbance: Disturbance | None = None) -> None:
        super().__init__(seed)
        self._disturbance = disturbance

    def make_primitives(self, env: RoboIRGEnv) -> MotionPrimitives:
        """Return what plans the stages' motions: the scripted expert's without narrow grips."""
        self._primitives = _WaypointPrimitives(env.session.world)
        return self._primitives

    def decide(self, env: RoboIRGEnv, instruction: str) -> Goal | None:
        """Return the episode's goal, and begin anew; the instruction is ignored."""
        self._gripper = OPEN  # its value after the last decision
        self._waits = 0  # decisions left that only let time pass
        self._stalled: ExpertWaypoint | None = None  # a move that is still to be made
        # The undisturbed waypoint (7,) of the last move, if that was disturbed.
        self._missed: NDArray[np.float64] | None = None
        self._rng = np.random.default_rng((env.episode.seed, self.seed))
        return super().decide(env, instruction)

    def act(self, observation: Observation) -> Actions:  # noqa: ARG002
        """Return the next waypoint (1, 7), perhaps disturbed, and set `last` and `labels`.

        A disturbance either lets the tool stay once where it is (a stall, after which the same
        decision is tried again), or moves the waypoint. Only moves are disturbed, not waypoints at
        which the gripper opens or closes.
        """
        decided = self._stalled or self._next()
        self._stalled = None
        self.last = decided
        wanted = decided.action
        is_move = wanted[-1] == LEAVE
        disturbance = self._disturbance
        if disturbance is not None and is_move and self._rng.random() < disturbance.stall:
            self._stalled = decided
            action = self._here(LEAVE)
        else:
            action = self._disturb(wanted)

        if is_move:
            self._missed = None if np.array_equal(action, wanted) else wanted
        elif self._missed is not None:
            # The disturbed move ended elsewhere, so the gripper is about to act in a wrong place:
            # the label is the place that was missed.
            wanted = np.append(self._missed[:POSE_SIZE], wanted[-1])
        self.labels = wanted[None]
        return action[None]

    def _next(self) -> ExpertWaypoint:
        """Return the next decision; after the last one the tool stays where it is.

        The trajectories of the expert are taken one by one. One that moves neither tool nor gripper
        gives no decision; in a stage that takes a time, it becomes decisions to wait.
        """
        if self._waits:
            self._waits -= 1
            return ExpertWaypoint(self._here(self._gripper))
        for stage, chunk in self._chunks:
            self.stage = stage
            decided = self._waypoint(chunk)
            if decided is not None:
                return decided
            if stage is not None and stage.primitive.steps:
                # Where the stage waits for a step, at least one wait lets the time pass.
                least = 1 if stage.primitive.kind == "hold_until" else 0
                self._waits = max(round(len(chunk) / WAIT_STEPS), least)
            if self._waits:
                return self._next()
        return ExpertWaypoint(self._here(LEAVE))

    def _waypoint(self, chunk: JointTrajectory) -> ExpertWaypoint | None:
        """Return the decision that replaces a trajectory of the expert, (n, 8) joint targets.

        If the arm moves, that is the pose at its end; if the gripper opens or closes, the present
        pose with the gripper's new value. None for a trajectory that does neither.
        """
        arm = chunk[:, :ARM_JOINTS]
        gripper = float(chunk[-1, ARM_JOINTS])
        if np.abs(arm - arm[0]).max() >= STILL:
            return self._move_to(self._pose_at(arm[-1], LEAVE))
        if gripper not in (OPEN, CLOSED) or gripper == self._gripper:
            return None
        self._gripper = gripper
        return ExpertWaypoint(self._here(gripper))

    def _move_to(self, action: CheckedActions) -> ExpertWaypoint:
        """Return the decision to move to a waypoint (7,), with the object that the waypoint is at.

        That object, its `anchor`, is the one that the present stage picks up, presses or places
        something on. A move straight up, and one that ends away from the object, has none.
        """
        world = self.env.session.world
        tool = np.asarray(world.robot.tool_pose.p)
        rises = action[2] > tool[2] + UP
        is_straight_up = rises and _distance_in_plane(action, tool) < ASIDE
        if is_straight_up or self.stage is None:
            return ExpertWaypoint(action)
        primitive = self.stage.primitive
        anchor = primitive.subject
        if primitive.kind in HANDLES_HELD:
            anchor = str(primitive.place)
        body = world.bodies.get(anchor)
        if body is None or _distance_in_plane(action, body.position) >= ON_THING:
            return ExpertWaypoint(action)
        return ExpertWaypoint(action, anchor, _TURNS.get(primitive.kind, "keep"))

    def _here(self, gripper: float) -> CheckedActions:
        """Return the waypoint (7,) at which the tool is, with a gripper value."""
        return self._pose_at(self.env.session.world.robot.arm_positions, gripper)

    def _pose_at(self, arm: NDArray[np.floating[Any]], gripper: float) -> CheckedActions:
        """Return the waypoint (7,) at joint positions (7,), with a gripper value."""
        position, rotation = self._primitives.tool_at(np.asarray(arm, np.float64))
        return np.concatenate([position, rotation.as_euler("xyz"), [gripper]])

    def _disturb(self, action: CheckedActions) -> CheckedActions:
        """Return a waypoint (7,), perhaps moved at random; see `Disturbance`.

        In free space it may be moved in all directions and turned; near the objects in x and y
        only. Waypoints at which the gripper opens or closes stay where they are. Random numbers are
        drawn in a fixed order, on which stored demonstrations depend.
        """
        disturbance = self._disturbance
        rng = self._rng
        if disturbance is None or action[-1] != LEAVE:
            return action
        moved = action.copy()
        is_free = action[2] > FREE_HEIGHT
        if is_free and rng.random() < disturbance.free:
            moved[:2] += rng.normal(0.0, disturbance.plane, 2)
            moved[2] += rng.normal(0.0, disturbance.height)
            moved[_YAW] += rng.normal(0.0, disturbance.turn)
        if not is_free and rng.random() < disturbance.low:
            moved[:2] += rng.normal(0.0, disturbance.miss, 2)
        return moved


def _distance_in_plane(point: NDArray[np.floating[Any]], other: Any) -> float:  # noqa: ANN401
    """Return the distance of two points in x and y, m; what else they hold does not count."""
    x, y = point[:2] - other[:2]
    return float(np.hypot(x, y))


class JointWaypointExpert(WaypointExpert):
    """The `WaypointExpert` in joint angles: actions are the joint targets on the way to waypoints.

    `labels` are (n, 8), one for each executed row: the joint targets on the way to the undisturbed
    waypoint. Both ways begin where the robot is, so that labels lead back to the expert's way from
    where a disturbance has moved the robot.
    """

    actions: ClassVar[str] = JOINT_ANGLE.name

    def decide(self, env: RoboIRGEnv, instruction: str) -> Goal | None:
        """Return the episode's goal, and begin anew; the instruction is ignored."""
        self._controller = WaypointController(env.session.world.robot)
        # What is left of the way to the waypoint, as trajectories.
        self._trajectories: Iterator[JointTrajectory] = iter(())
        # What is left of the way to the undisturbed waypoint (n, 8); None if nothing is disturbed.
        self._wanted_path: JointTrajectory | None = None
        return super().decide(env, instruction)

    def act(self, observation: Observation) -> Actions:
        """Return joint targets (n, 8) on the way to the next waypoint, and set `labels` (n, 8).

        One call returns the move to the waypoint, and the next one the gripper's action there, if
        there is one.
        """
        executed = next(self._trajectories, None)
        if executed is None:
            (action,) = super().act(observation)
            (wanted,) = self.labels
            self._wanted_path = None
            if not np.array_equal(action, wanted):
                self._wanted_path = self._path_to(wanted)
            self._trajectories = self._controller.trajectories(action)
            executed = next(self._trajectories)
        if self._wanted_path is None:
            self.labels = executed
        else:
            # As many rows of this path as are executed; if it is shorter, its end is repeated.
            last = len(self._wanted_path) - 1
            self.labels = self._wanted_path[np.minimum(np.arange(len(executed)), last)]
            self._wanted_path = self._wanted_path[min(len(executed), last) :]
        return executed

    def _path_to(self, waypoint: CheckedActions) -> JointTrajectory:
        """Return joint targets (n, 8): the move to a waypoint (7,), then its gripper action."""
        move = next(self._controller.trajectories(waypoint))
        if waypoint[-1] == LEAVE:
            return move
        end = np.append(move[-1, :ARM_JOINTS], waypoint[-1])
        return np.concatenate([move, np.tile(end, (GRIPPER_STEPS, 1))])


class _WaypointPrimitives(MotionPrimitives):
    """The expert's motions for waypoints, whose gripper is either open or closed.

    A failed grasp is repeated as a whole, with open fingers, and not with narrower ones.
    """

    def _grasp_and_lift(self, cube: str, opening: float) -> Iterator[JointTrajectory]:
        """Yield the trajectories of a grasp; none for an attempt with narrower fingers."""
        if opening == OPEN:
            yield from super()._grasp_and_lift(cube, opening)

    def tool_at(self, arm: NDArray[np.float64]) -> tuple[NDArray[np.float64], Rotation]:
        """Return position (3,), m, and rotation of the tool at joint positions (7,)."""
        pose = self._planner.forward_kinematics(arm)
        return pose.position, pose.rotation
