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
from roboirg.policies.contract.json_values import as_json
from roboirg.policies.remote.endpoints import ActionSpaceName, RemoteOptions
from roboirg.policies.remote.protocols import Protocol
from roboirg.policies.remote.remote_policy import RemotePolicy

PROTOCOL_VERSION = 1
_MOST_SHOWN = 80
"""Characters of a server's value in an error message."""
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
        """Check URL and options; the observations have what these ask for."""
        super().__init__(url, seed)
        self.cameras = ("front", "wrist") if self.options.wrist else ("front",)
        self.demonstration_frames = "all" if self.options.video else "none"
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
        protocol_version = as_json(hello.get("protocol_version"))
        if protocol_version != PROTOCOL_VERSION:
            raise PolicyReplyError(
                f"{self.connection} speaks version {_clipped(protocol_version)} of "
                f"vla-eval's protocol; this client speaks version {PROTOCOL_VERSION}."
            )
        # Such as "openvla, vla-eval 0.8".
        version = f"{hello.get('model_server')}, vla-eval {hello.get('harness_version')}"
        return {"version": version, **hello}

    def begin_episode(self, demonstration: Demonstration) -> None:  # noqa: ARG002
        """Begin an episode; the demonstration goes with the first observation, if it is wanted.

        The URL and the server must both want it.
        """
        self._check_params()
        self._subgoal = None
        sends_video = self.options.video and self._wants("send_video_history")
        if not sends_video:
            self.take_demonstration()
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
        """Send an observation; return the action of the reply, one row.

        What else is sent depends on the options, and on what the server says that it wants.
        """
        payload = observation_payload(
            observation,
            self.take_demonstration(),
            has_wrist=self.options.wrist and self._wants("send_wrist_image"),
            has_state=self.options.state and self._wants("send_state"),
        )
        if self._subgoal is not None:
            payload["subgoal"] = self._subgoal

        reply = self._send("observation", payload, awaited="action")
        if "action" in reply:
            reply = {"actions": reply["action"], **reply}  # the name that `read_actions` reads
        return self.read_actions(reply)

    def _send(self, kind: str, payload: Mapping[str, Any], awaited: str = "") -> dict[str, Any]:
        """Send a payload in an envelope, and return that of the answer.

        An answer has the number of its request. The beginning of an episode has none; an error in
        it comes before the next one.

        Args:
            kind: of the message, such as ``observation``.
            payload: what it holds.
            awaited: kind of the answer; empty to wait for none, and return ``{}``.
        """
        from roboirg.policies.remote.message_codec import pack

        self._number += 1
        sent = {"type": kind, "payload": payload, "seq": self._number, "timestamp": time.time()}
        data = pack(sent, text_keys=True)
        if not awaited:
            self.connection.exchange(data, "", is_numbered=True)
            return {}
        answer = self.connection.exchange(data, is_numbered=True)
        answer_kind = as_json(answer.get("type"))  # arrays cannot be compared
        number = as_json(answer.get("seq"))
        content = answer.get("payload")
        if answer_kind == awaited and number == self._number and isinstance(content, dict):
            return content
        if isinstance(content, dict):
            self.refuse_error(content)
        if answer_kind == "error":
            raise self.connection.error_reply(str(content))
        self.refuse_error(answer)
        raise PolicyReplyError(
            f"{self.connection} sent a message of type {_clipped(answer_kind)!r} with number "
            f"{_clipped(number)}, where {awaited!r} with number {self._number} was expected."
        )

    @property
    def _server_params(self) -> Mapping[str, Any]:
        """What the server's hello says about observations, by name; empty if it says nothing."""
        params = self.metadata.get("observation_params")
        return params if isinstance(params, Mapping) else {}

    def _wants(self, name: str) -> bool:
        """Return whether the server wants to be shown something; by default it does."""
        return bool(self._server_params.get(name, True))

    def _check_params(self) -> None:
        """Raise if the server acts in another action space than the URL gives."""
        wanted = self._server_params.get("action_space")
        if wanted not in (None, self.actions):
            raise InvalidValueError(
                f"The server acts in the action space {_clipped(wanted)!r}, but the policy's URL "
                f"says actions={self.actions}."
            )


def observation_payload(
    observation: Mapping[str, Any],
    demonstration: Demonstration | None,
    *,
    has_wrist: bool,
    has_state: bool,
) -> dict[str, Any]:
    """Return an observation as vla-eval's model servers expect it.

    Args:
        observation: as the environment returns it.
        demonstration: with the first observation of an episode; None later, or to leave it out.
        has_wrist: whether the pictures of the wrist camera are sent, too.
        has_state: whether proprioception is sent, too.
    """
    images = {"agentview": observation["front_rgb"]}
    if has_wrist:
        images["wrist"] = observation["wrist_rgb"]
    payload: dict[str, Any] = {"images": images, "task_description": observation["instruction"]}
    if has_state:
        payload["states"] = proprioception(observation)
    if demonstration is not None and len(demonstration["joint_positions"]):  # there is a video
        payload["video_history"] = list(demonstration["front_rgb"])
        if has_wrist:
            payload["wrist_video_history"] = list(demonstration["wrist_rgb"])
        payload["episode_restart"] = True
    return payload


def _clipped(value: object) -> str:
    """Return what a server has sent as a text that is short enough for a message."""
    return str(value)[:_MOST_SHOWN]


PROTOCOL = Protocol(
    name="vla-eval",
    client=VlaEvalPolicy,
)
