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

import time
from collections.abc import Iterator
from typing import Any, ClassVar, Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from roboirg.core.errors import InvalidValueError
from roboirg.core.observations import Demonstration, Observation, proprioception
from roboirg.policies.contract.base import Policy, close_policy
from roboirg.policies.contract.option_checking import Seconds
from roboirg.policies.remote.client.remote_policy import RemotePolicy
from roboirg.policies.remote.endpoints import RemoteOptions
from roboirg.policies.remote.protocol import Protocol
from roboirg.policies.remote.service import (
    PICTURE_BYTES,
    Handler,
    MakePolicy,
    Message,
    Service,
    act,
    read_request,
    read_state,
    request_limit,
    tell_change,
)

EXECUTED = 16
"""Rows of a chunk of 20 that are executed, as in RoboMME's experiments; the recurrent memories
were trained at this stride."""
MAX_FRAMES = 4096
"""Frames of an episode that the published models can tell apart."""
_IMAGES_AXES = 5

SubgoalField = Literal["grounded", "simple", "none"]


class MmeVlaOptions(RemoteOptions):
    """Options of mme-vla://.

    Attributes:
        execute: rows of a chunk that are executed.
        history: whether to send every frame; the baseline has no memory.
        subgoals: kind of subgoals the checkpoint was trained with.
        part: frames per message.
    """

    timeout: Seconds = Field(600.0, gt=0)
    execute: int = Field(EXECUTED, ge=1)
    history: bool = True
    subgoals: SubgoalField = "grounded"
    part: int = Field(EXECUTED, ge=1)


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
        self._frames_sent = 0

    def begin_episode(self, demonstration: Demonstration) -> None:
        """Clear the server's memory; the demonstration goes with the first frame."""
        self._subgoal, self._frames_sent = None, 0
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

    def request_actions(self, observation: Observation) -> NDArray[np.floating[Any]]:
        """Send the frames since the last call, then request actions."""
        if self.options.history:
            if self._demonstration is not None:
                demonstration, self._demonstration = self._demonstration, None
                self._send_beginning(demonstration, observation)
            else:
                self._send_history(observation)
        message = {
            "observation/image": observation["front_rgb"],
            "observation/wrist_image": observation["wrist_rgb"],
            "observation/state": _state(observation),
            "prompt": self.instruction.lower(),
        }
        if self._subgoal is not None:
            message[f"{self.options.subgoals}_subgoal"] = self._subgoal
        return self.read_actions(self.request(message))[: self.options.execute]

    def _send_beginning(self, demonstration: Demonstration, observation: Observation) -> None:
        """Send the T frames of the video and the first frame of the policy's turn, number T."""
        length = len(demonstration["joint_positions"])
        # The demonstration draws pictures when they are read, so it is not asked for none.
        no_pictures = np.empty((0, *observation["front_rgb"].shape), np.uint8)
        video = demonstration["front_rgb"] if length else no_pictures
        states = proprioception(demonstration["joint_positions"], demonstration["gripper"])
        start = length
        for part in _parts(
            video, states, observation["front_rgb"], _state(observation), self.options.part
        ):
            self._send_frames(*part, start)
            start = 0  # the server keeps the first that is not 0

    def _send_history(self, observation: Observation) -> None:
        """Send the frames after each action since the last call, also in parts."""
        seen = observation["history"] or (observation,)
        for start in range(0, len(seen), self.options.part):
            part = seen[start : start + self.options.part]
            images = np.stack([one["front_rgb"] for one in part])
            self._send_frames(images, np.stack([_state(one) for one in part]), 0)

    def _send_frames(
        self, images: NDArray[np.uint8], states: NDArray[np.float32], start: int
    ) -> None:
        """Add frames to the server's memory.

        Args:
            images: (n, H, W, 3).
            states: (n, 8).
            start: frames of the episode before the policy's turn, or 0.
        """
        self._frames_sent += len(images)
        if self._frames_sent > MAX_FRAMES:
            raise InvalidValueError(
                f"The episode has {self._frames_sent} frames, but the memory of MME-VLA holds "
                f"{MAX_FRAMES}; play fewer steps."
            )
        message = {
            "add_buffer": True,
            "images": images[:, None],
            "state": states,
            "exec_start_idx": start,
        }
        self.request_confirmed(message, "add_buffer_finished")


class MmeVlaService(Service):
    """Answers ``reset``, ``add_buffer`` and requests for actions, in that order of precedence."""

    # The original client sends a video in one message, with the pictures of the front camera.
    max_request_bytes: ClassVar[int] = request_limit(PICTURE_BYTES)

    def __init__(self, make_policy: MakePolicy) -> None:
        super().__init__(make_policy)
        self._policy: Policy | None = None
        self._clear()

    def new_handler(self) -> Handler:
        """Return the handler that all connections share."""
        return self._handle

    def _handle(self, message: Message) -> dict[str, Any]:
        start = time.perf_counter()
        if message.get("reset"):
            self._clear()
            return {"reset_finished": True, "reset_time_ms": _milliseconds_since(start)}
        if message.get("add_buffer"):
            self._add_frames(message)
            return {"add_buffer_finished": True, "add_buffer_time_ms": _milliseconds_since(start)}
        actions, milliseconds = self._infer(message)
        return {"actions": actions, "infer_time_ms": milliseconds}

    def _clear(self) -> None:
        close_policy(self._policy)
        self._policy = None
        self._frames: list[dict[str, NDArray[Any]]] = []
        self._count = self._turn_start = 0
        self._said = ""

    def _add_frames(self, message: Message) -> None:
        images = np.asarray(message.get("images"))
        if images.dtype != np.uint8 or images.ndim != _IMAGES_AXES or images.shape[1] != 1:
            raise ValueError(
                f"'images' must be uint8 (T, 1, H, W, 3); got {images.dtype} {images.shape}."
            )
        joints, gripper = read_state(message, "state")
        if len(joints) != len(images):
            raise ValueError(f"There are {len(images)} images but {len(joints)} states.")
        if self._count + len(images) > MAX_FRAMES:
            raise ValueError(f"An episode has more than {MAX_FRAMES} frames.")
        self._count += len(images)
        self._turn_start = self._turn_start or int(message.get("exec_start_idx", 0))
        self._frames += [
            {"front_rgb": image[0], "joint_positions": arm, "gripper": fingers}
            for image, arm, fingers in zip(images, joints, gripper, strict=True)
        ]

    def _infer(self, message: Message) -> tuple[NDArray[np.float64], float]:
        observation = read_request(message)
        instruction = observation["instruction"]
        if self._policy is None:
            self._policy = self.make_policy()
            video = self._frames[: self._turn_start]
            self._policy.reset(instruction, _demonstration(video, observation))
            self._frames, self._said = [], instruction
        steps = max(self._count - self._turn_start - 1, 0)
        self._said = tell_change(self._policy, self._said, observation, steps)
        history = tuple({**frame, "instruction": instruction} for frame in self._frames)
        self._frames = []
        observation["history"] = history  # type: ignore[typeddict-item]
        follow, subgoal = getattr(self._policy, "follow", None), _subgoal(message)
        if callable(follow) and subgoal is not None:
            follow(subgoal)
        return act(self._policy, observation)


def _parts(
    video: NDArray[np.uint8],
    states: NDArray[np.float32],
    now: NDArray[np.uint8],
    state: NDArray[np.float32],
    size: int,
) -> Iterator[tuple[NDArray[np.uint8], NDArray[np.float32]]]:
    """Yield a video and the frame after it, `size` frames at a time, without one large copy."""
    for start in range(0, len(video) + 1, size):
        images, rows = video[start : start + size], states[start : start + size]
        if start + size > len(video):
            images, rows = np.concatenate([images, now[None]]), np.concatenate([rows, state[None]])
        yield images, rows


def _state(observation: Observation) -> NDArray[np.float32]:
    return proprioception(observation["joint_positions"], observation["gripper"])


def _demonstration(
    frames: list[dict[str, NDArray[Any]]], observation: Observation
) -> Demonstration:
    """Return the frames before the policy's turn; the protocol has no wrist pictures of them."""
    fields = ("front_rgb", "joint_positions", "gripper")
    if not frames:
        return {field: np.asarray(observation[field])[None][:0] for field in fields}  # type: ignore[literal-required]
    return {field: np.stack([frame[field] for frame in frames]) for field in fields}


def _subgoal(message: Message) -> str | None:
    subgoal = message.get("grounded_subgoal") or message.get("simple_subgoal")
    return None if subgoal is None else str(subgoal)


def _milliseconds_since(start: float) -> float:
    return 1000 * (time.perf_counter() - start)


PROTOCOL = Protocol(
    name="mme-vla",
    summary="the policies published with RoboMME",
    memory="shared by all connections",
    clients={"mme-vla": MmeVlaPolicy},
    service=MmeVlaService,
)
