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

TASK, SETTING, SPLIT, EPISODE = "PickXtimes", "explicit", "train", 0
MAX_STEPS = 140
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
        joints = self.actions.shape[1] == JOINT_ANGLE.size
        return np.asarray(
            self.observation["joint_positions" if joints else "end_effector"], np.float64
        )


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
    poses: list[Rows] = []
    if needs.actions != JOINT_ANGLE.name:
        _keep_poses(env, poses)
    try:
        observation, info = env.reset()
        expert = OraclePolicy()
        expert.attach(env)
        expert.reset(observation["instruction"], info["demonstration"])
        moments = []
        for piece in _pieces(expert, min(rows, MAX_ROWS)):
            poses.clear()
            before = cast("Observation", observation)
            observation, _, ended, late, _ = env.step_chunk(piece)
            actions = np.column_stack([poses, piece[: len(poses), -1:]]) if poses else piece
            moments.append(ExpertMoment(before, actions))
            if ended or late:
                break
        return ExpertEpisode(before["instruction"], info["demonstration"], moments)
    finally:
        env.close()


def _pieces(expert: OraclePolicy, rows: int) -> Iterator[Rows]:
    """Yield what the expert does, some rows at a time; it plans after the ones before."""
    steps = 0
    while steps < MAX_STEPS:
        # The expert knows where everything is, so it looks at no observation.
        chunk = np.asarray(expert.act(cast("Observation", {})), np.float64)
        for start in range(0, len(chunk), rows):
            yield chunk[start : start + rows]
        steps += len(chunk)


def _keep_poses(env: RoboIRGEnv, poses: list[Rows]) -> None:
    from roboirg.simulation.proprioception import Proprioception

    reader: list[Proprioception] = []

    def keep(env: RoboIRGEnv, is_demonstration: bool) -> None:  # noqa: ARG001 - a hook
        if not reader:
            reader.append(Proprioception(env.session.world.robot))
        reader[0].update()
        poses.append(reader[0].read()["end_effector"])

    env.set_frame_hook(keep)
