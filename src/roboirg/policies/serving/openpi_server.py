"""A policy served as openpi serves one: no reset, no memory that connections share.

A connection has a policy of its own; an episode begins with the connection, and when the prompt
changes.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from roboirg.policies.base import Policy
from roboirg.policies.serving.service import Answer, Message, Service, act, finish, read_request


class OpenpiService(Service):
    """Answers `infer`."""

    def open(self) -> Answer:
        """A conversation with a policy of its own."""
        return _Conversation(self._make()).answer


class _Conversation:
    def __init__(self, policy: Policy) -> None:
        self._policy = policy
        self._prompt: str | None = None

    def answer(self, message: Message) -> dict[str, Any]:
        observation = read_request(message)
        if observation["instruction"] != self._prompt:
            if self._prompt is not None:
                finish(self._policy)
            self._prompt = observation["instruction"]
            self._policy.reset(self._prompt, _no_video(observation["front_rgb"].shape))
        actions, milliseconds = act(self._policy, observation)
        return {"actions": actions, "server_timing": {"infer_ms": milliseconds}}


def _no_video(shape: tuple[int, ...]) -> dict[str, Any]:
    return {
        "front_rgb": np.zeros((0, *shape), np.uint8),
        "wrist_rgb": np.zeros((0, *shape), np.uint8),
        "joint_positions": np.zeros((0, 7), np.float32),
        "gripper": np.zeros((0, 2), np.float32),
    }
