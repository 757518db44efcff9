"""Split the long trajectories of privileged policies into chunks of the horizon."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from roboirg.apps.real.control.robot import HORIZON
from roboirg.core.observations import Demonstration, Observation
from roboirg.policies.contract.base import Policy, PrivilegedPolicy

if TYPE_CHECKING:
    from roboirg.envs.environment import RoboIRGEnv


class ChunkedPolicy:
    """A privileged policy that returns its trajectories a chunk at a time.

    It reads the simulator's state instead of observations, so the rest of a trajectory stays valid.
    All other policies get a new observation after every chunk.
    """

    def __init__(self, policy: Policy) -> None:
        self._policy = policy
        self._left: NDArray[np.floating[Any]] = np.zeros((0, 8))

    def attach(self, env: RoboIRGEnv) -> None:
        """Pass the environment on."""
        if isinstance(self._policy, PrivilegedPolicy):
            self._policy.attach(env)

    def reset(self, instruction: str, demonstration: Demonstration) -> None:
        """Start an episode."""
        self._left = self._left[:0]
        self._policy.reset(instruction, demonstration)

    def act(self, observation: Observation) -> NDArray[np.floating[Any]]:
        """Return at most `HORIZON` actions."""
        if not len(self._left):
            self._left = np.atleast_2d(self._policy.act(observation))
        chunk, self._left = self._left[:HORIZON], self._left[HORIZON:]
        return chunk
