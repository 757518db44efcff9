"""vla-eval://host:port: model servers of the harness vla-eval, as it drives them on RoboMME.

The harness asks for an action at every control step; a server that predicts chunks keeps the rest
itself. The client opens with a hello, to which the server replies with what it wants to be shown;
an episode begins and ends with a message of its own, and an observation has one reply, the action.
"""

from __future__ import annotations

import contextlib
from collections.abc import Mapping
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from roboirg.core.errors import InvalidValueError, PolicyReplyError, RoboIRGError
from roboirg.core.observations import Demonstration, Observation, proprioception
from roboirg.policies.contract.option_checking import Seconds
from roboirg.policies.remote.client.remote_policy import RemotePolicy
from roboirg.policies.remote.endpoints import ActionSpaceName, RemoteOptions
from roboirg.policies.remote.protocol import Protocol
from roboirg.policies.remote.transport import Transport

TASK = {"name": "RoboIRGBench"}
"""Sent at the beginning of an episode. The harness sends the task here, which would give away more
than the instruction."""
_ENVELOPE = Transport(
    "websocket",
    "roboirg.policies.remote.client.envelope_connection:EnvelopeConnection",
    "roboirg.policies.remote.serving.websocket_server:WebsocketServer",
)


class VlaEvalOptions(RemoteOptions):
    """Options of vla-eval://.

    Attributes:
        actions: action space of the checkpoint.
        wrist: whether to send wrist pictures, unless the server asks for them.
        state: likewise proprioception.
        video: likewise the demonstration.
    """

    timeout: Seconds = Field(120.0, gt=0)
    actions: ActionSpaceName = "joint_angle"
    wrist: bool = True
    state: bool = True
    video: bool = True


class VlaEvalPolicy(RemotePolicy):
    """Client of a model server of vla-eval."""

    options_type: ClassVar[type[RemoteOptions]] = VlaEvalOptions
    options: VlaEvalOptions
    transport: ClassVar[Transport] = _ENVELOPE
    deterministic: ClassVar[bool] = False

    def __init__(self, url: str, seed: int = 0) -> None:
        super().__init__(url, seed)
        self.cameras = ("front", "wrist") if self.options.wrist else ("front",)
        self.demonstration_frames = "all" if self.options.video else "none"
        self._demonstration: Demonstration | None = None
        self._subgoal: str | None = None
        self._in_episode = False

    def begin_episode(self, demonstration: Demonstration) -> None:
        """Begin an episode; the demonstration goes with the first observation."""
        self._check_params()
        self._subgoal = None
        shows = self.options.video and self._wants("send_video_history")
        self._demonstration = demonstration if shows else None
        self.request({"type": "episode_start", "payload": {"task": TASK}})
        self._in_episode = True

    def close(self) -> None:
        """Report the end of the episode to the server, and disconnect."""
        if self._in_episode:
            self._in_episode = False
            with contextlib.suppress(RoboIRGError):  # it is over for the server too
                self.request({"type": "episode_end", "payload": {}})
        super().close()

    def follow(self, subgoal: str) -> None:
        """Send a subgoal with every observation from now on."""
        self._subgoal = subgoal

    def request_actions(self, observation: Observation) -> NDArray[np.floating[Any]]:
        """Send an observation; return the action of the reply, one row."""
        images = {"agentview": observation["front_rgb"]}
        wrist = self.options.wrist and self._wants("send_wrist_image")
        if wrist:
            images["wrist"] = observation["wrist_rgb"]
        shown: dict[str, Any] = {"images": images, "task_description": self.instruction}
        if self.options.state and self._wants("send_state"):
            shown["states"] = proprioception(observation["joint_positions"], observation["gripper"])
        demonstration, self._demonstration = self._demonstration, None
        if demonstration is not None and len(demonstration["joint_positions"]):
            shown["video_history"] = list(demonstration["front_rgb"])
            if wrist:
                shown["wrist_video_history"] = list(demonstration["wrist_rgb"])
            shown["episode_restart"] = True
        if self._subgoal is not None:
            shown["subgoal"] = self._subgoal
        return self.read_actions(_as_rows(self.request({"type": "observation", "payload": shown})))

    def _wants(self, name: str) -> bool:
        """Return whether the server wants to be shown something; by default it does."""
        params = self.metadata.get("observation_params")
        return not isinstance(params, Mapping) or bool(params.get(name, True))

    def _check_params(self) -> None:
        params = self.metadata.get("observation_params")
        wanted = params.get("action_space") if isinstance(params, Mapping) else None
        if wanted not in (None, self.actions):
            raise InvalidValueError(
                f"The server acts in the action space {str(wanted)[:80]!r}, but the policy's URL "
                f"says actions={self.actions}."
            )


def _as_rows(reply: Mapping[str, Any]) -> dict[str, Any]:
    """Return the reply with its action, which is a single one, as rows."""
    name = next((name for name in ("actions", "action") if name in reply), None)
    if name is None:
        return dict(reply)
    try:
        return {"actions": np.atleast_2d(np.asarray(reply[name], np.float64))}
    except (TypeError, ValueError) as error:
        raise PolicyReplyError(
            f"The server sent an action that is not an array: {error}."
        ) from error


PROTOCOL = Protocol(
    name="vla-eval",
    summary="model servers of vla-eval",
    memory="up to the server",
    clients={"vla-eval": VlaEvalPolicy},
)
