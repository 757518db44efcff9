"""An episode of the scripted expert: what it saw, and what it did next."""

from __future__ import annotations

import contextlib
from collections.abc import Callable, Iterator, Mapping
from dataclasses import replace
from typing import TYPE_CHECKING, Any, NamedTuple, cast

import numpy as np
from numpy.typing import NDArray

from roboirg.core.observations import Observation
from roboirg.core.policy_needs import PolicyNeeds
from roboirg.policies.builtin.oracle_policy import OraclePolicy
from roboirg.policies.contract.base import Policy

if TYPE_CHECKING:
    from roboirg.envs.environment import RoboIRGEnv

TASK = "PickXtimes"
SETTING = "explicit"
SPLIT = "train"
EPISODE = 0
EXPERT_STEPS = 140
"""Control steps: the expert takes a cube at step 84 and carries it until step 164."""
MAX_ROWS = 16
"""Rows of a chunk that are compared, at most: the policy is asked again after them."""


Rows = NDArray[np.float64]
"""Actions, one a row; or the joints of one moment."""


class ExpertMoment(NamedTuple):
    """What a policy is shown at a moment of the expert's episode.

    Attributes:
        observation: as the policy requires it.
        actions: of the expert from then on, (n, 8): joint targets (rad) and the gripper.
    """

    observation: Observation
    actions: Rows

    @property
    def still(self) -> Rows:
        """The joints of the robot at this moment, (7,), rad."""
        return np.asarray(self.observation["joint_positions"], np.float64)


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
        policy: whose needs the environment meets; it acts in joint angles, as the expert does.
        rows: actions in a chunk of the policy.

    Raises:
        MissingDependencyError: the simulator is not installed.
        RenderDeviceError: nothing can render.
    """
    from roboirg.envs.factory import make

    needs = replace(PolicyNeeds.of(policy), grounded=False)
    env = make(TASK, setting=SETTING, split=SPLIT, episode=EPISODE, **needs.env_options)
    with contextlib.closing(env):
        return _play(env, min(rows, MAX_ROWS))


def _play(env: RoboIRGEnv, rows: int) -> ExpertEpisode:
    """Play the expert, and keep the moments at which the policy would have been asked.

    Args:
        env: where it plays.
        rows: the expert's actions from one moment to the next.
    """
    observation, info = env.reset()
    instruction = observation["instruction"]
    demonstration = info["demonstration"]
    expert = OraclePolicy()
    expert.attach(env)
    expert.reset(instruction, demonstration)
    moments: list[ExpertMoment] = []
    for piece in _pieces(expert, rows):
        moments.append(ExpertMoment(cast("Observation", observation), piece))
        observation, _, is_over, is_late, _ = env.step_chunk(piece)
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
