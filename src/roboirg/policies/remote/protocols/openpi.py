"""openpi://host:port: servers of the openpi repository and compatible ones.

Such a server remembers nothing: there is no reset, and every request holds all that a reply
needs. Several episodes may use it at once. Our service has one policy per connection; an episode
begins with the connection and when the prompt changes. So a policy behind our service cannot hear
an instruction in turns: every utterance begins an episode that knows nothing of the one before.
"""

from __future__ import annotations

from typing import Any, ClassVar

from pydantic import Field

from roboirg.core.actions import Actions
from roboirg.core.errors import InvalidValueError
from roboirg.core.observations import Demonstration, Observation, proprioception
from roboirg.policies.contract.base import close_policy
from roboirg.policies.contract.option_checking import NOT_COMPARED
from roboirg.policies.remote.endpoints import MIB, ActionSpaceName, RemoteOptions
from roboirg.policies.remote.protocols import Protocol
from roboirg.policies.remote.remote_policy import RemotePolicy
from roboirg.policies.remote.service import Message, Service, read_request, stack_video

FIELDS = ("front_rgb", "wrist_rgb", "joint_positions", "gripper")
"""Fields of the demonstration without frames that a policy behind our service gets."""


class OpenpiOptions(RemoteOptions):
    """Options of openpi://.

    Attributes:
        execute: rows of a chunk that are executed; None for all.
        actions: action space of the checkpoint.
        front: key of the front picture; empty to leave it out.
        wrist: key of the wrist picture; empty to leave it out.
        state: key of the eight numbers of proprioception.
        prompt: key of the instruction.
    """

    shared: bool = Field(True, exclude=NOT_COMPARED)
    execute: int | None = Field(None, ge=1)
    actions: ActionSpaceName = "joint_angle"
    front: str = "observation/image"
    wrist: str = "observation/wrist_image"
    state: str = Field("observation/state", min_length=1)
    prompt: str = Field("prompt", min_length=1)


class OpenpiPolicy(RemotePolicy):
    """Client of an openpi server."""

    options_type: ClassVar[type[RemoteOptions]] = OpenpiOptions
    options: OpenpiOptions
    demonstration_frames: ClassVar[str] = "none"
    deterministic: ClassVar[bool] = False

    def __init__(self, url: str, seed: int = 0) -> None:
        """Check URL and options; pictures without a key are not required."""
        super().__init__(url, seed)
        self._keys: dict[str, str] = {}
        """The keys of the pictures, by the camera."""
        if self.options.front:
            self._keys["front"] = self.options.front
        if self.options.wrist:
            self._keys["wrist"] = self.options.wrist
        self.cameras = tuple(self._keys)
        names = [self.options.state, self.options.prompt, *self._keys.values()]
        if len(set(names)) < len(names):
            raise InvalidValueError(
                f"Policy {url!r} has the key of one entry of its requests for another, too; front, "
                "wrist, state and prompt must differ."
            )

    def begin_episode(self, demonstration: Demonstration) -> None:
        """Do nothing: the protocol has neither a reset nor a memory."""

    def request_actions(self, observation: Observation) -> Actions:
        """Send the observation; return the first `execute` rows of the reply, or all.

        The names of the message's entries are those that the URL's options give.
        """
        message: dict[str, Any] = {}
        for camera, key in self._keys.items():
            message[key] = observation[f"{camera}_rgb"]  # type: ignore[literal-required]
        message[self.options.state] = proprioception(observation)
        message[self.options.prompt] = self.instruction
        return self.read_actions(self.request(message))[: self.options.execute]


class OpenpiService(Service):
    """Answers requests with one policy per connection, which is reset when the prompt changes."""

    max_request_bytes: ClassVar[int] = 64 * MIB

    def connection(self) -> Service:
        """Return a service with a policy of its own."""
        return OpenpiService(self.make_policy)

    def handle(self, message: Message) -> dict[str, Any]:
        """Return the reply to a request: the policy's actions, and how long they took.

        Another prompt than the last one begins a new episode, as the protocol has no sign of it.
        """
        observation = read_request(message)
        # The protocol has no beginning of an episode: another prompt is taken for one.
        if self.policy is None or observation["instruction"] != self.said:
            close_policy(self.policy)
            self.begin(observation["instruction"], stack_video((), observation, FIELDS))
        actions, milliseconds = self.act(observation)
        return {"actions": actions, "server_timing": {"infer_ms": milliseconds}}


PROTOCOL = Protocol(
    name="openpi",
    client=OpenpiPolicy,
    service=OpenpiService,
)
