"""challenge://host:port and challenge+http://host:port: servers for the RoboMME challenge.

The server is shown everything since the last request and decides itself how many actions it gives;
all of them are executed. The protocol has no parts: the video is one message.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray
from pydantic import Field, field_validator

from roboirg.core.actions import find_action_space
from roboirg.core.observations import Demonstration, Observation
from roboirg.policies.remote.endpoints import RemoteOptions
from roboirg.policies.remote.http_connection import HttpConnection
from roboirg.policies.remote.remote_policy import RemotePolicy
from roboirg.policies.remote.server_session import Connect
from roboirg.policies.remote.websocket_connection import WebsocketConnection

FIELDS: Mapping[str, str] = {
    "front_rgb_list": "front_rgb",
    "wrist_rgb_list": "wrist_rgb",
    "joint_state_list": "joint_positions",
    "eef_state_list": "end_effector",
    "gripper_state_list": "gripper",
}
"""The challenge's names of what is sent, and this benchmark's."""


class ChallengeOptions(RemoteOptions):
    """Options of challenge:// and challenge+http://.

    Attributes:
        actions: the action space of the submission.
    """

    timeout: float = Field(120.0, gt=0)
    actions: str = "joint_angle"

    @field_validator("actions")
    @classmethod
    def _known(cls, name: str) -> str:
        return find_action_space(name).name


class ChallengePolicy(RemotePolicy):
    """A policy made for the RoboMME challenge, over a websocket."""

    options_type: ClassVar[type[RemoteOptions]] = ChallengeOptions
    connect: ClassVar[Connect] = WebsocketConnection
    options: ChallengeOptions
    observe_every: ClassVar[int] = 1

    def __init__(self, url: str, seed: int = 0) -> None:
        super().__init__(url, seed)
        self._space = find_action_space(self.options.actions)
        self.actions = self._space.name
        self._demonstration: Demonstration | None = None

    def begin(self, demonstration: Demonstration) -> None:
        """Have the server forget everything; the demonstration goes with the first request."""
        self._demonstration = demonstration
        self._confirm({"reset": True}, "reset_finished")

    def answer(self, observation: Observation) -> NDArray[np.floating[Any]]:
        """Send what was seen since the last call, and get actions."""
        demonstration, self._demonstration = self._demonstration, None
        first = demonstration is not None
        shown = demonstration if first else None
        seen = (observation,) if first else observation["history"] or (observation,)
        message = {
            "task_goal": [self._instruction],
            "is_first_step": first,
            **{name: _moments(field, shown, seen) for name, field in FIELDS.items()},
        }
        return self._rows(self._session.ask(message))


class ChallengeHttpPolicy(ChallengePolicy):
    """A policy made for the RoboMME challenge, over HTTP."""

    connect: ClassVar[Connect] = HttpConnection


def _moments(
    field: str, shown: Demonstration | None, seen: Sequence[Observation]
) -> list[NDArray[Any]]:
    """A field at every moment of the video, if there is one to send, and of what was seen."""
    video: Sequence[NDArray[Any]] = ()
    if shown is not None and len(shown["joint_positions"]):
        video = list(shown[field])
    return [*video, *(moment[field] for moment in seen)]  # type: ignore[literal-required]
