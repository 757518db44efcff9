"""Policies whose answers may be longer than a chunk, given out a chunk at a time."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from roboirg.core.observations import Demonstration, Observation
from roboirg.policies.base import Policy, PrivilegedPolicy
from roboirg.real.control.robot import HORIZON

if TYPE_CHECKING:
    from roboirg.envs.environment import RoboIRGEnv


class ChunkedPolicy:
    """A privileged policy, whose whole movements have to be done, in chunks of the horizon.

    It looks behind the scenes and does not go by observations, so what is left of a movement needs
    none. All other policies look again after every chunk.
    """

    def __init__(self, policy: Policy) -> None:
        self._policy = policy
        self._left: NDArray[np.floating[Any]] = np.zeros((0, 8))

    def attach(self, env: RoboIRGEnv) -> None:
        """Hand the environment on."""
        if isinstance(self._policy, PrivilegedPolicy):
            self._policy.attach(env)

    def reset(self, instruction: str, demonstration: Demonstration) -> None:
        """Begin."""
        self._left = self._left[:0]
        self._policy.reset(instruction, demonstration)

    def act(self, observation: Observation) -> NDArray[np.floating[Any]]:
        """At most a horizon of actions."""
        if not len(self._left):
            self._left = np.atleast_2d(self._policy.act(observation))
        chunk, self._left = self._left[:HORIZON], self._left[HORIZON:]
        return chunk
