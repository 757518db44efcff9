"""An episode of the scripted expert: what it saw, and what it did next."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import replace
from typing import TYPE_CHECKING, Any, NamedTuple, cast

import numpy as np
from numpy.typing import NDArray

from roboirg.core.actions import JOINT_ANGLE
from roboirg.core.observations import Observation
from roboirg.core.policy_needs import PolicyNeeds
from roboirg.policies.builtin.oracle_policy import OraclePolicy
from roboirg.policies.contract.base import Policy

if TYPE_CHECKING:
    from roboirg.envs.environment import RoboIRGEnv
    from roboirg.simulation.proprioception import Proprioception

TASK = "PickXtimes"
SETTING = "explicit"
SPLIT = "train"
EPISODE = 0
EXPERT_STEPS = 140
"""Control steps: the expert takes a cube at step 84 and carries it until step 164."""
MAX_ROWS = 16
"""Rows of a chunk that are compared, at most: the policy is asked again after them."""


Rows = NDArray[np.float64]
"""Actions or poses, one a row; or one alone."""


class ExpertMoment(NamedTuple):
    """What a policy is shown at a moment of the expert's episode.

    Attributes:
        observation: as the policy requires it.
        actions: of the expert from then on, (n, size), in the policy's action space: joint targets,
            or the tool's pose after each control step; and the gripper.
    """

    observation: Observation
    actions: Rows

    @property
    def still(self) -> Rows:
        """The joints (7,) or the pose (6,) of the robot at this moment, without the gripper."""
        if self.actions.shape[1] == JOINT_ANGLE.size:
            return np.asarray(self.observation["joint_positions"], np.float64)
        return np.asarray(self.observation["end_effector"], np.float64)


class ExpertEpisode(NamedTuple):
    """The beginning of an episode that the expert plays.

    Attributes:
        instruction: the text.
        demonstration: without a step.
        moments: in order.
    """

    instruction: str
    demonstration: Mapping[str, Any]
    moments: list[ExpertMoment]


RecordExpert = Callable[[Policy, int], ExpertEpisode]
"""Returns the expert's episode as a policy, whose chunks have that many rows, would see it."""


def record_expert(policy: Policy, rows: int) -> ExpertEpisode:
    """Play the expert in the simulator, and keep what the policy would see.

    Args:
        policy: whose needs the environment meets.
        rows: actions in a chunk of the policy.

    Raises:
        MissingDependencyError: the simulator is not installed.
        RenderDeviceError: nothing can render.
    """
    from roboirg.envs.factory import make

    needs = PolicyNeeds.of(policy)
    shown = replace(needs, actions=JOINT_ANGLE.name, grounded=False).env_options
    env = make(TASK, setting=SETTING, split=SPLIT, episode=EPISODE, **shown)
    keeper = None
    if needs.actions != JOINT_ANGLE.name:
        keeper = _PoseKeeper()
        env.set_frame_hook(keeper.keep)
    try:
        return _play(env, min(rows, MAX_ROWS), keeper)
    finally:
        env.close()


def _play(env: RoboIRGEnv, rows: int, keeper: _PoseKeeper | None) -> ExpertEpisode:
    """Play the expert, and keep the moments at which the policy would have been asked.

    Args:
        env: where it plays.
        rows: the expert's actions from one moment to the next.
        keeper: notes the tool's pose after each control step, as a hook of `env`, for a policy
            whose actions are poses; None for one whose actions are joint angles, as the expert's
            are.
    """
    observation, info = env.reset()
    instruction = observation["instruction"]
    demonstration = info["demonstration"]
    expert = OraclePolicy()
    expert.attach(env)
    expert.reset(instruction, demonstration)
    moments = []
    for piece in _pieces(expert, rows):
        before = cast("Observation", observation)
        if keeper is not None:
            keeper.poses.clear()
        observation, _, is_over, is_late, _ = env.step_chunk(piece)
        actions = piece if keeper is None else keeper.with_gripper(piece)
        moments.append(ExpertMoment(before, actions))
        if is_over or is_late:
            break
    return ExpertEpisode(instruction, demonstration, moments)


def _pieces(expert: OraclePolicy, rows: int) -> Iterator[Rows]:
    """Yield the expert's actions, (n, 8) with n at most `rows`, for `EXPERT_STEPS` steps or more.

    The caller must execute each piece before it takes the next one, as the expert plans by the
    state of the world.
    """
    steps = 0
    while steps < EXPERT_STEPS:
        # The expert knows where everything is, so it looks at no observation.
        chunk = np.asarray(expert.act(cast("Observation", {})), np.float64)
        for start in range(0, len(chunk), rows):
            yield chunk[start : start + rows]
        steps += len(chunk)


class _PoseKeeper:
    """Keeps the tool's pose after each control step.

    Attributes:
        poses: (6,) each.
    """

    def __init__(self) -> None:
        self.poses: list[Rows] = []
        self._reader: Proprioception | None = None

    def keep(self, env: RoboIRGEnv, is_demonstration: bool) -> None:  # noqa: ARG002 - a hook
        """Keep the pose of the tool now; called by the environment after each control step."""
        if self._reader is None:
            from roboirg.simulation.proprioception import Proprioception

            self._reader = Proprioception(env.session.world.robot)
        self._reader.update()
        self.poses.append(self._reader.read()["end_effector"])

    def with_gripper(self, actions: Rows) -> Rows:
        """Return the poses, (n, 7), each with the gripper of the action that led to it.

        If the episode ended early, there are fewer poses than actions.
        """
        return np.column_stack([self.poses, actions[: len(self.poses), -1:]])
