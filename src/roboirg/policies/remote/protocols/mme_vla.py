"""mme-vla://host:port: the policies published with RoboMME, which remember what they saw.

The server has one memory for all its connections, so an episode locks it. The first frames (the
video and the first frame of the policy's turn) may be 210 MB; they are sent in parts of a fixed
length, because the server answers nothing while it encodes, and compiles its encoder for each new
length. With parts as long as the later messages it compiles one length for all and one for the
rest.

A service handles ``reset``, which clears the memory; ``add_buffer``, which adds frames; and
requests for actions. The first request for actions after a reset begins the policy's episode: the
frames before its turn are the demonstration.
"""

from __future__ import annotations

import itertools
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from typing import Any, ClassVar, Literal, NamedTuple

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from roboirg.core.actions import Actions
from roboirg.core.errors import InvalidValueError
from roboirg.core.observations import Demonstration, Observation, proprioception
from roboirg.policies.contract.base import Policy, SubgoalFollower
from roboirg.policies.contract.option_checking import NOT_COMPARED, Seconds
from roboirg.policies.remote.endpoints import MIB, RemoteOptions
from roboirg.policies.remote.protocols import Protocol
from roboirg.policies.remote.remote_policy import RemotePolicy
from roboirg.policies.remote.service import (
    Message,
    Service,
    read_array,
    read_request,
    split_state,
    stack_video,
)

EXECUTED = 16
"""Rows of a chunk of 20 that are executed, as in RoboMME's experiments; the recurrent memories
were trained at this stride."""

SubgoalField = Literal["grounded", "simple", "none"]


class MmeVlaOptions(RemoteOptions):
    """Options of mme-vla://.

    Attributes:
        execute: rows of a chunk that are executed.
        history: whether to send every frame; the baseline has no memory.
        subgoals: kind of subgoals the checkpoint was trained with.
        part: frames per message.
    """

    timeout: Seconds = Field(600.0, gt=0, exclude=NOT_COMPARED)
    execute: int = Field(EXECUTED, ge=1)
    history: bool = True
    subgoals: SubgoalField = "grounded"
    part: int = Field(EXECUTED, ge=1, exclude=NOT_COMPARED)


FIELDS = ("front_rgb", "joint_positions", "gripper")
"""Fields of a demonstration that the protocol carries: it has no wrist pictures of the video."""


class _Frame(NamedTuple):
    """What the server remembers of a moment: the front picture and the state (8,)."""

    picture: NDArray[np.uint8]
    state: NDArray[np.float32]


class MmeVlaPolicy(RemotePolicy):
    """Client of a server of the MME-VLA repository."""

    options_type: ClassVar[type[RemoteOptions]] = MmeVlaOptions
    options: MmeVlaOptions
    lowers_prompt: ClassVar[bool] = True

    def __init__(self, url: str, seed: int = 0) -> None:
        """Check URL and options; with `history`, every frame is required, and the whole video."""
        super().__init__(url, seed)
        self.demonstration_frames = "none"
        self.observe_every: int | None = None
        if self.options.history:
            self.demonstration_frames = "all"
            self.observe_every = 1
        self.history_cameras = ("front",)
        self._subgoal: str | None = None

    def begin_episode(self, demonstration: Demonstration) -> None:  # noqa: ARG002
        """Clear the server's memory; the demonstration goes with the first frame."""
        self._subgoal = None
        self.request_confirmed({"reset": True}, "reset_finished")

    def follow(self, subgoal: str) -> None:
        """Send a subgoal with every request for actions from now on.

        Raises:
            InvalidValueError: the URL says ``subgoals=none``.
        """
        if self.options.subgoals == "none":
            raise InvalidValueError(
                "A planner gives subgoals to an mme-vla:// policy with subgoals=none; use "
                "subgoals=grounded or subgoals=simple."
            )
        self._subgoal = subgoal.lower()

    def request_actions(self, observation: Observation) -> Actions:
        """Send the frames since the last call, then request actions; return the first `execute`."""
        if self.options.history:
            self._send_frames(observation)
        message = {
            "observation/image": observation["front_rgb"],
            "observation/wrist_image": observation["wrist_rgb"],
            "observation/state": proprioception(observation),
            "prompt": self.instruction.lower(),
        }
        if self._subgoal is not None:
            message[f"{self.options.subgoals}_subgoal"] = self._subgoal
        return self.read_actions(self.request(message))[: self.options.execute]

    def _send_frames(self, observation: Observation) -> None:
        """Add the new frames to the server's memory, in messages of at most `part` frames.

        In the first call of an episode these are the T frames of the video and the first one of the
        policy's turn, which has the number T (``exec_start_idx``); later, one after each action
        since then.
        """
        demonstration = self.take_demonstration()
        frames = _new_frames(demonstration, observation)
        start = 0 if demonstration is None else len(demonstration["joint_positions"])
        while part := list(itertools.islice(frames, self.options.part)):
            pictures = np.stack([frame.picture for frame in part])
            message = {
                "add_buffer": True,
                "images": pictures[:, None],
                "state": np.stack([frame.state for frame in part]),
                "exec_start_idx": start,
            }
            self.request_confirmed(message, "add_buffer_finished")
            start = 0  # only the first message needs it: the server keeps the first that is not 0


@dataclass
class _SentFrames:
    """What the client has sent since the reset.

    Attributes:
        new: frames since the last request for actions.
        count: of all frames.
        turn_start: number of the first frame of the policy's turn; 0 until a message has one.
    """

    new: list[dict[str, NDArray[Any]]] = field(default_factory=list)
    count: int = 0
    turn_start: int = 0

    def add(self, message: Message) -> None:
        """Add the frames in a message, and the number of the first one of the policy's turn.

        The first number that is not 0 counts, as the published server keeps it.
        """
        images = read_array(message, "images", "uint8", ("T", 1, "H", "W", 3))
        states = read_array(message, "state", "real numbers", ("T", 8))
        self.count += len(images)
        if self.turn_start == 0:
            self.turn_start = int(message.get("exec_start_idx", 0))
        self.new += [
            {"front_rgb": image[0], **split_state(state)}
            for image, state in zip(images, states, strict=True)
        ]


class MmeVlaService(Service):
    """Answers ``reset``, ``add_buffer`` and requests for actions, in that order of precedence."""

    # The original client sends a video in one message, with the pictures of the front camera.
    max_request_bytes: ClassVar[int] = 284 * MIB

    def __init__(self, make_policy: Callable[[], Policy]) -> None:
        super().__init__(make_policy)
        self._sent = _SentFrames()

    def handle(self, message: Message) -> dict[str, Any]:
        """Return the reply to a reset, to frames for the memory, or to a request for actions.

        A message with ``reset`` is a reset whatever else it has; then ``add_buffer`` counts.
        """
        begin = time.perf_counter()
        if message.get("reset"):
            self.forget()
            self._sent = _SentFrames()
            done = "reset"
        elif message.get("add_buffer"):
            self._sent.add(message)
            done = "add_buffer"
        else:
            actions, milliseconds = self._infer(message)
            return {"actions": actions, "infer_time_ms": milliseconds}
        return {f"{done}_finished": True, f"{done}_time_ms": 1000 * (time.perf_counter() - begin)}

    def _infer(self, message: Message) -> tuple[NDArray[np.float64], float]:
        """Return the policy's actions and their milliseconds; the first request begins its episode.

        Of the kept frames, those before the policy's turn are then its demonstration; what comes
        between two requests is its history. Kept frames are dropped.
        """
        observation = read_request(message)
        instruction = observation["instruction"]
        frames = self._sent.new
        if self.policy is None:
            video = frames[: self._sent.turn_start]
            self.begin(instruction, stack_video(video, observation, FIELDS))
            frames = []
        # The first frame of the turn was seen before any step.
        steps = self._sent.count - self._sent.turn_start - 1
        self.hear(instruction, max(steps, 0))

        history = tuple({**frame, "instruction": instruction} for frame in frames)
        observation["history"] = history  # type: ignore[typeddict-item]
        self._sent.new = []
        subgoal = message.get("grounded_subgoal") or message.get("simple_subgoal")
        if isinstance(self.policy, SubgoalFollower) and subgoal is not None:
            self.policy.follow(str(subgoal))
        return self.act(observation)


def _new_frames(demonstration: Demonstration | None, observation: Observation) -> Iterator[_Frame]:
    """Yield the frames of the video, if there is one to send, then those of the policy's turn.

    The video's length is that of its joints: to read its pictures would draw them. `demonstration`
    is None for all but the first request of an episode.
    """
    if demonstration is not None and len(demonstration["joint_positions"]):
        states = proprioception(demonstration)
        for picture, state in zip(demonstration["front_rgb"], states, strict=True):
            yield _Frame(picture, state)
    for seen in observation["history"] or (observation,):
        yield _Frame(seen["front_rgb"], proprioception(seen))


PROTOCOL = Protocol(
    name="mme-vla",
    client=MmeVlaPolicy,
    service=MmeVlaService,
)
