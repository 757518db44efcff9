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
from collections.abc import Sequence
from typing import Any, ClassVar, Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from roboirg.core.actions import Actions
from roboirg.core.errors import InvalidValueError
from roboirg.core.observations import Demonstration, Observation, proprioception
from roboirg.policies.contract.base import SubgoalFollower
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


class MmeVlaPolicy(RemotePolicy):
    """Client of a server of the MME-VLA repository."""

    options_type: ClassVar[type[RemoteOptions]] = MmeVlaOptions
    options: MmeVlaOptions
    lowers_prompt: ClassVar[bool] = True

    def __init__(self, url: str, seed: int = 0) -> None:
        super().__init__(url, seed)
        self.demonstration_frames = "all" if self.options.history else "none"
        self.observe_every = 1 if self.options.history else None
        self.history_cameras = ("front",)
        self._demonstration: Demonstration | None = None
        self._subgoal: str | None = None

    def begin_episode(self, demonstration: Demonstration) -> None:
        """Clear the server's memory; the demonstration goes with the first frame."""
        self._subgoal = None
        self._demonstration = demonstration if self.options.history else None
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
        """Send the frames since the last call, then request actions."""
        if self.options.history:
            self._send_frames(observation)
        message = {
            "observation/image": observation["front_rgb"],
            "observation/wrist_image": observation["wrist_rgb"],
            "observation/state": _state(observation),
            "prompt": self.instruction.lower(),
        }
        if self._subgoal is not None:
            message[f"{self.options.subgoals}_subgoal"] = self._subgoal
        return self.read_actions(self.request(message))[: self.options.execute]

    def _send_frames(self, observation: Observation) -> None:
        """Add frames to the server's memory, in parts.

        These are, at first, the T frames of the video and the first frame of the policy's turn,
        number T; later, those after each action since the last call.
        """
        demonstration, self._demonstration = self._demonstration, None
        states: Any = ()
        video: Any = ()
        if demonstration is not None:
            states = proprioception(demonstration["joint_positions"], demonstration["gripper"])
            # Pictures are drawn when they are read, so none are asked for where there are none.
            video = demonstration["front_rgb"] if len(states) else ()
        seen = observation["history"] or (observation,)
        now = ((one["front_rgb"], _state(one)) for one in seen)
        frames, start = itertools.chain(zip(video, states, strict=True), now), len(states)
        while part := tuple(itertools.islice(frames, self.options.part)):
            images, rows = map(np.stack, zip(*part, strict=True))
            message = {
                "add_buffer": True,
                "images": images[:, None],
                "state": rows,
                "exec_start_idx": start,
            }
            self.request_confirmed(message, "add_buffer_finished")
            start = 0  # the server keeps the first that is not 0


class MmeVlaService(Service):
    """Answers ``reset``, ``add_buffer`` and requests for actions, in that order of precedence."""

    # The original client sends a video in one message, with the pictures of the front camera.
    max_request_bytes: ClassVar[int] = 284 * MIB
    _turn_start = _count = 0
    _frames: tuple[dict[str, NDArray[Any]], ...] = ()

    def handle(self, message: Message) -> dict[str, Any]:
        """Return the reply to a message."""
        begin = time.perf_counter()
        done = next((key for key in ("reset", "add_buffer") if message.get(key)), None)
        if done is None:
            actions, milliseconds = self._infer(message)
            return {"actions": actions, "infer_time_ms": milliseconds}
        if done == "reset":
            self.forget()
            self._frames, self._count, self._turn_start = (), 0, 0
        else:
            self._add_frames(message)
        return {f"{done}_finished": True, f"{done}_time_ms": 1000 * (time.perf_counter() - begin)}

    def _add_frames(self, message: Message) -> None:
        images = read_array(message, "images", "u1", ("T", 1, "H", "W", 3))
        states = read_array(message, "state", "fiu", ("T", 8))
        self._count += len(images)
        self._turn_start = self._turn_start or int(message.get("exec_start_idx", 0))
        self._frames += tuple(
            {"front_rgb": image[0], **split_state(state)}
            for image, state in zip(images, states, strict=True)
        )

    def _infer(self, message: Message) -> tuple[NDArray[np.float64], float]:
        observation = read_request(message)
        instruction = observation["instruction"]
        if self.policy is None:
            video = self._frames[: self._turn_start]
            self.begin(instruction, _demonstration(video, observation))
            self._frames = ()
        self.hear(instruction, max(self._count - self._turn_start - 1, 0))
        history = tuple({**frame, "instruction": instruction} for frame in self._frames)
        self._frames = ()
        observation["history"] = history  # type: ignore[typeddict-item]
        subgoal = message.get("grounded_subgoal") or message.get("simple_subgoal")
        if isinstance(self.policy, SubgoalFollower) and subgoal is not None:
            self.policy.follow(str(subgoal))
        return self.act(observation)


def _state(observation: Observation) -> NDArray[np.float32]:
    return proprioception(observation["joint_positions"], observation["gripper"])


def _demonstration(
    frames: Sequence[dict[str, NDArray[Any]]], observation: Observation
) -> Demonstration:
    """Return the frames before the policy's turn; the protocol has no wrist pictures of them."""
    fields = ("front_rgb", "joint_positions", "gripper")
    if not frames:
        return {field: np.asarray(observation[field])[None][:0] for field in fields}  # type: ignore[literal-required]
    return {field: np.stack([frame[field] for frame in frames]) for field in fields}


PROTOCOL = Protocol(
    name="mme-vla",
    client=MmeVlaPolicy,
    service=MmeVlaService,
)
