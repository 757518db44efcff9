"""A wrapper that makes a chunk of actions one step, so that less is drawn and sent."""

from __future__ import annotations

from typing import Any, cast

import gymnasium
import numpy as np
from gymnasium import spaces
from numpy.typing import ArrayLike, NDArray

from roboirg.core.actions import find_action_space
from roboirg.core.errors import InvalidActionError
from roboirg.core.field_types import check_whole
from roboirg.envs.environment import RoboIRGEnv, StepResult


class ActionChunks(gymnasium.Wrapper[dict[str, Any], NDArray[Any], dict[str, Any], NDArray[Any]]):
    """Executes a chunk of actions at each step, until the episode ends, and observes once.

    A step returns what `RoboIRGEnv.step_chunk` does: the last observation, and an info with all
    events since the chunk before. The actions that are left at the end of an episode are not
    executed.

    Wrappers that change actions or observations belong around it; those inside see no step.

    Args:
        env: a `RoboIRGEnv`, or what `gymnasium.make` returns for it.
        length: number of actions in a chunk.

    Raises:
        InvalidValueError: the length is no whole number from 1 on.
    """

    def __init__(self, env: gymnasium.Env[dict[str, Any], NDArray[Any]], length: int) -> None:
        super().__init__(env)
        check_whole("length", length)
        self._inner = cast("RoboIRGEnv", env.unwrapped)
        space = find_action_space(self._inner.actions)
        low = np.tile(space.low, (length, 1))
        high = np.tile(space.high, (length, 1))
        self.action_space = spaces.Box(low, high, dtype=np.float64)

    def step(self, action: ArrayLike) -> StepResult:
        """Execute a chunk.

        Args:
            action: (length, 8), in the other spaces (length, 7).

        Raises:
            InvalidActionError: wrong shape, not numeric or not finite; nothing has moved.
            ResetNeeded: the episode is over or has not been reset.
        """
        shape = np.shape(action)
        if shape != self.action_space.shape:
            raise InvalidActionError(
                f"A chunk has shape {self.action_space.shape}; got shape {shape}."
            )
        return self._inner.step_chunk(action)
