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
    anchor: str | None
    turn: str


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
        self._gripper, self._waits = OPEN, 0
        self._stalled: ExpertWaypoint | None = None
        self._missed: NDArray[np.float64] | None = None
        self._rng = np.random.default_rng((env.episode.seed, self.seed))
        return super().decide(env, instruction)

    def act(self, observation: Observation) -> Actions:  # noqa: ARG002
        """Return the next waypoint (1, 7), perhaps disturbed; `last` is the undisturbed one."""
        decided = self._stalled or self._next()
        self._stalled = None
        self.last, wanted = decided, decided.action
        how = self._disturbance
        if how is not None and wanted[-1] == LEAVE and self._rng.random() < how.stall:
            self._stalled = decided
            action = self._here(LEAVE)
        else:
            action = self._disturb(wanted)
        if wanted[-1] == LEAVE:
            self._missed = None if np.array_equal(action, wanted) else wanted
        elif self._missed is not None:  # where the gripper is not meant to open or close
            wanted = np.append(self._missed[:POSE_SIZE], wanted[-1])
        self.labels = wanted[None]
        return action[None]

    def _next(self) -> ExpertWaypoint:
        """Return the next decision; after the last one the tool stays where it is."""
        if self._waits:
            self._waits -= 1
            return ExpertWaypoint(self._here(self._gripper), None, "keep")
        for stage, chunk in self._chunks:
            self.stage = stage
            decided = self._waypoint(chunk)
            if decided is not None:
                return decided
            if stage is not None and stage.primitive.steps:
                # Time must pass while something is held until then.
                least = int(stage.primitive.kind == "hold_until")
                self._waits = max(round(len(chunk) / WAIT_STEPS), least)
            if self._waits:
                return self._next()
        return ExpertWaypoint(self._here(LEAVE), None, "keep")

    def _waypoint(self, chunk: JointTrajectory) -> ExpertWaypoint | None:
        """Return the waypoint of a trajectory; None if it moves neither tool nor gripper.

        Then the expert waits: a gripper that is closed again takes `WAIT_STEPS`.
        """
        gripper = float(chunk[-1, ARM_JOINTS])
        if np.abs(chunk[:, :ARM_JOINTS] - chunk[0, :ARM_JOINTS]).max() < STILL:
            if gripper not in (OPEN, CLOSED) or gripper == self._gripper:
                return None
            self._gripper = gripper
            return ExpertWaypoint(self._here(gripper), None, "keep")
        action = self._pose_at(chunk[-1, :ARM_JOINTS], LEAVE)
        return ExpertWaypoint(action, *self._meaning(action))

    def _meaning(self, action: CheckedActions) -> tuple[str | None, str]:
        """Return the anchor of a move, and how the tool turns in it."""
        env = self.env
        tool = np.asarray(env.session.world.robot.tool_pose.p)
        is_up = action[2] > tool[2] + UP and np.hypot(*(action[:2] - tool[:2])) < ASIDE
        if is_up or self.stage is None:
            return None, "keep"
        primitive = self.stage.primitive
        name = primitive.place if primitive.kind in HANDLES_HELD else primitive.subject
        body = env.session.world.bodies.get(str(name))
        if body is not None and np.hypot(*(action[:2] - body.position[:2])) < ON_THING:
            return str(name), _TURNS.get(primitive.kind, "keep")
        return None, "keep"

    def _here(self, gripper: float) -> CheckedActions:
        robot = self.env.session.world.robot
        return self._pose_at(robot.arm_positions, gripper)

    def _pose_at(self, arm: NDArray[np.floating[Any]], gripper: float) -> CheckedActions:
        """Return the waypoint at joint positions (7)."""
        position, rotation = self._primitives.tool_at(np.asarray(arm, np.float64))
        return np.concatenate([position, rotation.as_euler("xyz"), [gripper]])

    def _disturb(self, action: CheckedActions) -> CheckedActions:
        """Return a waypoint moved at random, if it is its turn; gripper actions stay."""
        how, rng = self._disturbance, self._rng
        if how is None or action[-1] != LEAVE:
            return action
        moved = action.copy()
        if action[2] > FREE_HEIGHT:
            if rng.random() < how.free:
                moved[:2] += rng.normal(0.0, how.plane, 2)
                moved[2] += rng.normal(0.0, how.height)
                moved[5] += rng.normal(0.0, how.turn)
        elif rng.random() < how.low:
            moved[:2] += rng.normal(0.0, how.miss, 2)
        return moved


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
        """Return the targets (n, 8) of the next move, perhaps disturbed, or of the gripper."""
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
            self.labels = self._way[np.minimum(np.arange(len(executed)), last)]
            self._way = self._way[min(len(executed), last) :]
        return executed

    def _way_of(self, waypoint: CheckedActions) -> JointTrajectory:
        """Return the way to a waypoint, with the gripper's action at its end."""
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
