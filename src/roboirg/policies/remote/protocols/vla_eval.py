"""vla-eval://host:port: model servers of the harness vla-eval, as it drives them on RoboMME.

The harness asks for an action at every control step; a server that predicts chunks keeps the rest
itself. The client opens with a hello, to which the server replies with what it wants to be shown;
an episode begins and ends with a message of its own, and an observation has one reply, the action.
"""

from __future__ import annotations

import contextlib
import time
from collections.abc import Mapping
from typing import Any, ClassVar

from roboirg.core.actions import Actions
from roboirg.core.errors import InvalidValueError, PolicyReplyError, RoboIRGError
from roboirg.core.observations import Demonstration, Observation, proprioception
from roboirg.core.version import __version__
from roboirg.policies.remote.endpoints import ActionSpaceName, RemoteOptions
from roboirg.policies.remote.protocols import Protocol
from roboirg.policies.remote.remote_policy import RemotePolicy

PROTOCOL_VERSION = 1
TASK = {"name": "RoboIRGBench"}
"""Sent at the beginning of an episode. The harness sends the task here, which would give away more
than the instruction."""


class VlaEvalOptions(RemoteOptions):
    """Options of vla-eval://.

    Attributes:
        actions: action space of the checkpoint.
        wrist: whether to send wrist pictures, unless the server asks for them.
        state: likewise proprioception.
        video: likewise the demonstration.
    """

    actions: ActionSpaceName = "joint_angle"
    wrist: bool = True
    state: bool = True
    video: bool = True


class VlaEvalPolicy(RemotePolicy):
    """Client of a model server of vla-eval."""

    options_type: ClassVar[type[RemoteOptions]] = VlaEvalOptions
    options: VlaEvalOptions
    deterministic: ClassVar[bool] = False

    def __init__(self, url: str, seed: int = 0) -> None:
        super().__init__(url, seed)
        self.cameras = ("front", "wrist") if self.options.wrist else ("front",)
        self.demonstration_frames = "all" if self.options.video else "none"
        self._demonstration: Demonstration | None = None
        self._subgoal: str | None = None
        self._in_episode = False
        self._number = 0

    def greet(self) -> Mapping[str, Any]:
        """Send a hello, and return that of the server, with a version made of it.

        Raises:
            PolicyReplyError: it is of another version of the protocol.
        """
        self._number = 0
        ours = {"harness_version": f"roboirg {__version__}", "protocol_version": PROTOCOL_VERSION}
        hello = self._send("hello", ours, awaited="hello")
        if hello.get("protocol_version") != PROTOCOL_VERSION:
            raise PolicyReplyError(
                f"{self.connection} speaks version {str(hello.get('protocol_version'))[:80]} of "
                f"vla-eval's protocol; this client speaks version {PROTOCOL_VERSION}."
            )
        version = f"{hello.get('model_server')}, vla-eval {hello.get('harness_version')}"
        return {"version": version, **hello}

    def begin_episode(self, demonstration: Demonstration) -> None:
        """Begin an episode; the demonstration goes with the first observation."""
        self._check_params()
        self._subgoal = None
        shows = self.options.video and self._wants("send_video_history")
        self._demonstration = demonstration if shows else None
        self._send("episode_start", {"task": TASK})
        self._in_episode = True

    def close(self) -> None:
        """Report the end of the episode to the server, and disconnect."""
        if self._in_episode:
            self._in_episode = False
            with contextlib.suppress(RoboIRGError):  # it is over for the server too
                self._send("episode_end", {})
        super().close()

    def follow(self, subgoal: str) -> None:
        """Send a subgoal with every observation from now on."""
        self._subgoal = subgoal

    def request_actions(self, observation: Observation) -> Actions:
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
        reply = self._send("observation", shown, awaited="action")
        alone = {"actions": reply["action"]} if "action" in reply else {}
        return self.read_actions({**alone, **reply})

    def _send(self, kind: str, payload: Mapping[str, Any], awaited: str = "") -> dict[str, Any]:
        """Send a payload in an envelope; return that of the answer, if one is awaited.

        An answer has the number of its request. The beginning of an episode has none; an error in
        it comes before the next one.
        """
        from roboirg.policies.remote.message_codec import pack

        self._number += 1
        sent = {"type": kind, "payload": payload, "seq": self._number, "timestamp": time.time()}
        answer = self.connection.exchange(
            pack(sent, text_keys=True), "a reply" if awaited else "", is_numbered=True
        )
        if not awaited:
            return {}
        found, number, inside = (answer.get(name) for name in ("type", "seq", "payload"))
        if found == "error":
            words = inside.get("error") if isinstance(inside, dict) else inside
            raise self.connection.error_reply(str(words))
        if found != awaited or number != self._number or not isinstance(inside, dict):
            raise PolicyReplyError(
                f"{self.connection} sent a message of type {str(found)[:80]!r} with number "
                f"{str(number)[:80]}, where {awaited!r} with number {self._number} was expected."
            )
        return inside

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


PROTOCOL = Protocol(
    name="vla-eval",
    client=VlaEvalPolicy,
)
