"""mme-vla://host:port: the policies published with RoboMME, which remember what they saw.

The server has one memory for all its connections, so an episode has it for itself. The first
frames (the video and the first moment of the policy's turn) may be 210 MB; they are sent in parts
of a fixed length, because the server answers nothing while it encodes, and compiles its encoder
anew for every length that it has not met. Parts as long as the later messages cost it one length
for all and one for what is left over.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any, ClassVar, Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from roboirg.core.errors import InvalidValueError
from roboirg.core.observations import Demonstration, Observation
from roboirg.policies.remote.endpoints import RemoteOptions
from roboirg.policies.remote.remote_policy import RemotePolicy, proprioception

EXECUTED = 16
"""Rows of a chunk of 20 that are executed, as in RoboMME's experiments; the recurrent memories
were trained at this stride."""
LONGEST_MEMORY = 4096
"""Frames of an episode that the published models can tell apart."""

SubgoalField = Literal["grounded", "simple", "none"]


class MmeVlaOptions(RemoteOptions):
    """Options of mme-vla://.

    Attributes:
        execute: how many rows of a chunk are executed.
        history: whether the server is sent every frame; the baseline has no memory.
        subgoals: which kind of subgoals the checkpoint was trained with.
        part: frames of one message.
    """

    timeout: float = Field(600.0, gt=0)
    execute: int = Field(EXECUTED, ge=1)
    history: bool = True
    subgoals: SubgoalField = "grounded"
    part: int = Field(EXECUTED, ge=1)


class MmeVlaPolicy(RemotePolicy):
    """A policy served by the MME-VLA repository."""

    options_type: ClassVar[type[RemoteOptions]] = MmeVlaOptions
    options: MmeVlaOptions

    def __init__(self, url: str, seed: int = 0) -> None:
        super().__init__(url, seed)
        self.demonstration_frames = "all" if self.options.history else "none"
        self.observe_every = 1 if self.options.history else None
        self.history_cameras = ("front",)
        self._demonstration: Demonstration | None = None
        self._subgoal: str | None = None
        self._remembered = 0

    def begin(self, demonstration: Demonstration) -> None:
        """Have the server forget everything; the demonstration goes with the first frame."""
        self._subgoal, self._remembered = None, 0
        self._demonstration = demonstration if self.options.history else None
        self._confirm({"reset": True}, "reset_finished")

    def follow(self, subgoal: str) -> None:
        """Send a subgoal with every request from now on.

        Raises:
            InvalidValueError: the URL says that the checkpoint knows none.
        """
        if self.options.subgoals == "none":
            raise InvalidValueError(
                "A planner gives subgoals to an mme-vla:// policy that has subgoals=none; say "
                "subgoals=grounded or subgoals=simple."
            )
        self._subgoal = subgoal.lower()

    def answer(self, observation: Observation) -> NDArray[np.floating[Any]]:
        """Send what was seen since the last call, then ask for actions.

        Raises:
            InvalidValueError: the episode is longer than the model's memory.
        """
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
            "prompt": self._instruction.lower(),
        }
        if self._subgoal is not None:
            message[f"{self.options.subgoals}_subgoal"] = self._subgoal
        return self._rows(self._session.ask(message))[: self.options.execute]

    def _send_beginning(self, demonstration: Demonstration, observation: Observation) -> None:
        """The video and the first moment of the policy's turn, which is frame number T."""
        length = len(demonstration["joint_positions"])
        # Pictures are drawn when they are read: without a video there are none to read.
        video = demonstration["front_rgb"] if length else observation["front_rgb"][None][:0]
        states = proprioception(demonstration["joint_positions"], demonstration["gripper"])
        start = length
        for images, state in _parts(
            video, states, observation["front_rgb"], _state(observation), self.options.part
        ):
            self._send_frames(images, state, start)
            start = 0  # the server keeps the first that is not

    def _send_history(self, observation: Observation) -> None:
        """The frames after each action since the last call, in parts as well."""
        seen = observation["history"] or (observation,)
        for start in range(0, len(seen), self.options.part):
            part = seen[start : start + self.options.part]
            images = np.stack([moment["front_rgb"] for moment in part])
            self._send_frames(images, np.stack([_state(moment) for moment in part]), 0)

    def _send_frames(
        self, images: NDArray[np.uint8], states: NDArray[np.float32], start: int
    ) -> None:
        """Have the server remember frames.

        Args:
            images: (n, H, W, 3).
            states: (n, 8).
            start: how many frames of the episode come before the policy's turn, or 0.
        """
        self._remembered += len(images)
        if self._remembered > LONGEST_MEMORY:
            raise InvalidValueError(
                f"The episode has {self._remembered} frames, and MME-VLA's memory counts to "
                f"{LONGEST_MEMORY}; play fewer steps."
            )
        message = {
            "add_buffer": True,
            "images": images[:, None],
            "state": states,
            "exec_start_idx": start,
        }
        self._confirm(message, "add_buffer_finished")


def _parts(
    video: NDArray[np.uint8],
    states: NDArray[np.float32],
    now: NDArray[np.uint8],
    state: NDArray[np.float32],
    size: int,
) -> Iterator[tuple[NDArray[np.uint8], NDArray[np.float32]]]:
    """A video and the moment after it, so many frames at a time; nothing large is copied whole."""
    for start in range(0, len(video) + 1, size):
        images, felt = video[start : start + size], states[start : start + size]
        if start + size > len(video):
            images, felt = np.concatenate([images, now[None]]), np.concatenate([felt, state[None]])
        yield images, felt


def _state(observation: Observation) -> NDArray[np.float32]:
    return proprioception(observation["joint_positions"], observation["gripper"])
