"""The scripted expert in waypoints, disturbed on the way: what a policy learns to act from."""

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
"""Gripper value of a waypoint that neither opens nor closes it."""
STILL = 1e-4
"""Radians; a trajectory whose joints stay within this of their start moves only the gripper."""
WAIT_STEPS = GRIPPER_STEPS + 1
"""Control steps of a waypoint at which the gripper stays as it is, but is opened or closed."""
ON_THING = 0.012
"""Meters in the plane within which a waypoint is at an object; some stay short of it."""
FREE_HEIGHT = 0.09
"""Tool height above which a disturbed waypoint touches nothing, m."""
UP = 0.05
"""Meters by which a move rises to be one straight up."""
ASIDE = 0.06
"""Meters aside within which it still is."""
_TURNS = {"pick_cube": "align", "pick_container": "align", "press": "home", "hover": "home"}
"""How the tool turns when it moves to the object of a motion; else it keeps its angle."""
_YAW = 5
"""Place of the angle about the vertical in a waypoint."""


class Disturbance(NamedTuple):
    """How far executed waypoints lie from the expert's; labels stay the expert's own.

    Attributes:
        free: probability that a waypoint in free space is moved.
        plane: standard deviation of that in x and y, m.
        height: of that in z, m.
        turn: of that about the vertical, rad.
        low: probability that a grasp or placement is moved, far enough to miss at times.
        miss: standard deviation of that in x and y, m.
        stall: probability that a move is not made, but the tool stays where it is once.
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
        anchor: name of the object at whose place it is; None for the place of the tool.
        turn: how the tool turns: ``keep``, ``align`` with the anchor, or ``home``.
    """

    action: CheckedActions
    anchor: str | None = None
    turn: str = "keep"


class WaypointExpert(OraclePolicy):
    """Executes the true goal in waypoints, some of them disturbed.

    Privileged. After a disturbance the expert goes on from where things are, so that its decisions
    show how to recover; what has failed is tried again.

    Attributes:
        last: the decision that `act` has just made.
        labels: (1, 7) what the expert would have done instead of the action that `act` has just
            returned: the same, unless it or the move before the gripper's action is disturbed.
    """

    actions: ClassVar[str] = WAYPOINT.name
    last: ExpertWaypoint
    labels: CheckedActions

    def __init__(self, seed: int = 0, disturbance: Disturbance | None = None) -> None:
        super().__init__(seed)
        self._disturbance = disturbance

    def make_primitives(self, env: RoboIRGEnv) -> MotionPrimitives:
        """Return the expert that executes the stages, without the retry in a narrow grip."""
        self._primitives = _WaypointPrimitives(env.session.world)
        return self._primitives

    def decide(self, env: RoboIRGEnv, instruction: str) -> Goal | None:
        """Return the episode's goal; the instruction is ignored."""
        self._gripper = OPEN
        self._waits = 0
        self._stalled: ExpertWaypoint | None = None
        self._missed: NDArray[np.float64] | None = None
        self._rng = np.random.default_rng((env.episode.seed, self.seed))
        return super().decide(env, instruction)

    def act(self, observation: Observation) -> Actions:  # noqa: ARG002
        """Return the next waypoint (1, 7), perhaps disturbed; `last` is the undisturbed one.

        A disturbance either lets the tool stay once where it is (a stall, after which the same
        decision is tried again), or moves the waypoint.
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

        Trajectories that move neither tool nor gripper give no decision; in a stage that takes a
        time, they become waits.
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
                # Where something is held until a step, at least one wait lets the time pass.
                least = 1 if stage.primitive.kind == "hold_until" else 0
                self._waits = max(round(len(chunk) / WAIT_STEPS), least)
            if self._waits:
                return self._next()
        return ExpertWaypoint(self._here(LEAVE))

    def _waypoint(self, chunk: JointTrajectory) -> ExpertWaypoint | None:
        """Return the waypoint that replaces a trajectory of the expert.

        If the arm moves, that is the pose at its end; if the gripper opens or closes, the present
        pose with its new value. A trajectory that does neither has none (None).
        """
        arm = chunk[:, :ARM_JOINTS]
        gripper = float(chunk[-1, ARM_JOINTS])
        is_arm_still = np.abs(arm - arm[0]).max() < STILL
        if not is_arm_still:
            return self._move_to(self._pose_at(arm[-1], LEAVE))
        if gripper not in (OPEN, CLOSED) or gripper == self._gripper:
            return None
        self._gripper = gripper
        return ExpertWaypoint(self._here(gripper))

    def _move_to(self, action: CheckedActions) -> ExpertWaypoint:
        """Return the decision to move to a pose, with the object that the pose is at.

        That object is its `anchor`, the one that the motion picks up or places something on. A move
        straight up, and one that ends away from the object, has none.
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
        robot = self.env.session.world.robot
        return self._pose_at(robot.arm_positions, gripper)

    def _pose_at(self, arm: NDArray[np.floating[Any]], gripper: float) -> CheckedActions:
        """Return the waypoint at joint positions (7)."""
        position, rotation = self._primitives.tool_at(np.asarray(arm, np.float64))
        return np.concatenate([position, rotation.as_euler("xyz"), [gripper]])

    def _disturb(self, action: CheckedActions) -> CheckedActions:
        """Return a waypoint, moved at random with the probability of `Disturbance`.

        In free space it may be moved far and turned; near the objects only a little and in the
        plane. Waypoints at which the gripper opens or closes stay where they are.
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
    """Return how far apart two points are on the table, m; what follows x and y does not count."""
    x, y = point[:2] - other[:2]
    return float(np.hypot(x, y))


class JointWaypointExpert(WaypointExpert):
    """The same expert in joint angles, which go where those of its waypoints go.

    `labels` are (n, 8): the targets of the undisturbed way after as many control steps, planned
    from where the disturbed one begins; after its end, that end. As both begin together, they lead
    from where the robot has been moved back to the expert's way.
    """

    actions: ClassVar[str] = JOINT_ANGLE.name

    def decide(self, env: RoboIRGEnv, instruction: str) -> Goal | None:
        """Return the episode's goal; the instruction is ignored."""
        self._controller = WaypointController(env.session.world.robot)
        self._moves: Iterator[JointTrajectory] = iter(())
        self._way: JointTrajectory | None = None
        return super().decide(env, instruction)

    def act(self, observation: Observation) -> Actions:
        """Return the joint targets (n, 8) of the next waypoint, perhaps disturbed.

        `labels` (n, 8) are the targets on the way to where the expert wanted to go: the returned
        ones, unless the waypoint was disturbed.
        """
        executed = next(self._moves, None)
        if executed is None:
            (action,) = super().act(observation)
            (wanted,) = self.labels
            self._way = None if np.array_equal(action, wanted) else self._way_of(wanted)
            self._moves = self._controller.trajectories(action)
            executed = next(self._moves)
        if self._way is None:
            self.labels = executed
        else:
            last = len(self._way) - 1
            # If the undisturbed way is shorter, its last target is repeated.
            self.labels = self._way[np.minimum(np.arange(len(executed)), last)]
            self._way = self._way[min(len(executed), last) :]
        return executed

    def _way_of(self, waypoint: CheckedActions) -> JointTrajectory:
        """Return the joint targets (n, 8) on the way to a waypoint, and of the gripper there."""
        move = next(self._controller.trajectories(waypoint))
        if waypoint[-1] == LEAVE:
            return move
        end = np.append(move[-1, :ARM_JOINTS], waypoint[-1])
        return np.concatenate([move, np.tile(end, (GRIPPER_STEPS, 1))])


class _WaypointPrimitives(MotionPrimitives):
    """The expert's primitives; a failed grasp is repeated as a whole, with open fingers."""

    def _grasp_and_lift(self, cube: str, opening: float) -> Iterator[JointTrajectory]:
        if opening == OPEN:
            yield from super()._grasp_and_lift(cube, opening)

    def tool_at(self, arm: NDArray[np.float64]) -> tuple[NDArray[np.float64], Rotation]:
        """Return position (m) and rotation of the tool at joint positions (7)."""
        pose = self._planner.forward_kinematics(arm)
        return pose.position, pose.rotation
