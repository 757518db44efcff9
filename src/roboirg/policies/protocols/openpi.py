"""openpi://host:port: servers of the openpi repository, and whatever speaks as they do.

Such a server remembers nothing: there is no reset, and every request holds all that an answer
needs. Several episodes may use it at the same time, and a request whose connection breaks is sent
once more.
"""

from __future__ import annotations

from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray
from pydantic import Field, field_validator

from roboirg.core.actions import find_action_space
from roboirg.core.errors import PolicyConnectionError
from roboirg.core.observations import Demonstration, Observation
from roboirg.policies.remote.endpoints import RemoteOptions
from roboirg.policies.remote.remote_policy import RemotePolicy, proprioception


class OpenpiOptions(RemoteOptions):
    """Options of openpi://.

    Attributes:
        execute: how many rows of a chunk are executed; all if it is None.
        actions: the action space of the checkpoint.
        front: key of the front picture; empty: not sent.
        wrist: key of the wrist picture; empty: not sent.
        state: key of the eight numbers that the robot feels.
        prompt: key of the instruction.
    """

    timeout: float = Field(120.0, gt=0)
    shared: bool = True
    execute: int | None = Field(None, ge=1)
    actions: str = "joint_angle"
    front: str = "observation/image"
    wrist: str = "observation/wrist_image"
    state: str = Field("observation/state", min_length=1)
    prompt: str = Field("prompt", min_length=1)

    @field_validator("actions")
    @classmethod
    def _known(cls, name: str) -> str:
        return find_action_space(name).name


class OpenpiPolicy(RemotePolicy):
    """A policy served by openpi."""

    options_type: ClassVar[type[RemoteOptions]] = OpenpiOptions
    options: OpenpiOptions
    demonstration_frames: ClassVar[str] = "none"
    deterministic: ClassVar[bool] = False

    def __init__(self, url: str, seed: int = 0) -> None:
        super().__init__(url, seed)
        self._space = find_action_space(self.options.actions)
        self.actions = self._space.name
        keys = {"front": self.options.front, "wrist": self.options.wrist}
        self._pictures = {key: f"{camera}_rgb" for camera, key in keys.items() if key}
        self.cameras = tuple(camera for camera, key in keys.items() if key)

    def begin(self, demonstration: Demonstration) -> None:
        """Nothing: the protocol has neither a reset nor a memory."""

    def answer(self, observation: Observation) -> NDArray[np.floating[Any]]:
        """The rows of one reply that are to be executed."""
        message = {
            **{key: observation[field] for key, field in self._pictures.items()},  # type: ignore[literal-required]
            self.options.state: proprioception(
                observation["joint_positions"], observation["gripper"]
            ),
            self.options.prompt: self._instruction,
        }
        try:
            reply = self._session.ask(message)
        except PolicyConnectionError:
            # Nothing is lost with the connection: the request says everything once more.
            self._session.reconnect()
            reply = self._session.ask(message)
        return self._rows(reply)[: self.options.execute]
