"""A policy served as MME-VLA serves one: one memory, whoever is connected.

`reset` forgets, `add_buffer` remembers frames, anything else asks for actions. The first request
after a reset begins the policy's episode: what was remembered before the turn is its demonstration.
"""

from __future__ import annotations

import time
from typing import Any

import numpy as np
from numpy.typing import NDArray

from roboirg.core.observations import Demonstration, Observation
from roboirg.policies.base import Policy
from roboirg.policies.serving.service import (
    Answer,
    MakePolicy,
    Message,
    Service,
    act,
    finish,
    read_request,
    read_state,
)

LONGEST_MEMORY = 4096
"""Frames of an episode that the published models can tell apart."""
_IMAGES_AXES = 5


class MmeVlaService(Service):
    """Answers `reset`, `add_buffer` and `infer`, in that order of precedence."""

    def __init__(self, make: MakePolicy) -> None:
        super().__init__(make)
        self._policy: Policy | None = None
        self._forget()

    def open(self) -> Answer:
        """The same for all connections."""
        return self._answer

    def _answer(self, message: Message) -> dict[str, Any]:
        start = time.perf_counter()
        if message.get("reset"):
            self._forget()
            return {"reset_finished": True, "reset_time_ms": _since(start)}
        if message.get("add_buffer"):
            self._remember(message)
            return {"add_buffer_finished": True, "add_buffer_time_ms": _since(start)}
        actions, milliseconds = self._infer(message)
        return {"actions": actions, "infer_time_ms": milliseconds}

    def _forget(self) -> None:
        finish(self._policy)
        self._policy = None
        self._frames: list[dict[str, NDArray[Any]]] = []
        self._count = self._turn = 0

    def _remember(self, message: Message) -> None:
        images = np.asarray(message.get("images"))
        if images.dtype != np.uint8 or images.ndim != _IMAGES_AXES or images.shape[1] != 1:
            raise ValueError(
                f"'images' has to be uint8 (T, 1, H, W, 3); got {images.dtype} {images.shape}."
            )
        joints, gripper = read_state(message, "state")
        if len(joints) != len(images):
            raise ValueError(f"There are {len(images)} images and {len(joints)} states.")
        if self._count + len(images) > LONGEST_MEMORY:
            raise ValueError(f"An episode has more than {LONGEST_MEMORY} frames.")
        self._count += len(images)
        self._turn = self._turn or int(message.get("exec_start_idx", 0))
        self._frames += [
            {"front_rgb": image[0], "joint_positions": arm, "gripper": fingers}
            for image, arm, fingers in zip(images, joints, gripper, strict=True)
        ]

    def _infer(self, message: Message) -> tuple[NDArray[np.float64], float]:
        observation = read_request(message)
        if self._policy is None:
            self._policy = self._make()
            shown = self._frames[: self._turn]
            self._policy.reset(observation["instruction"], _demonstration(shown, observation))
            self._frames = []
        instruction = observation["instruction"]
        history = tuple({**frame, "instruction": instruction} for frame in self._frames)
        self._frames = []
        observation["history"] = history  # type: ignore[typeddict-item]
        follow, subgoal = getattr(self._policy, "follow", None), _subgoal(message)
        if callable(follow) and subgoal is not None:
            follow(subgoal)
        return act(self._policy, observation)


def _demonstration(
    frames: list[dict[str, NDArray[Any]]], observation: Observation
) -> Demonstration:
    """What was remembered before the turn; the wrist's pictures are not sent."""
    fields = ("front_rgb", "joint_positions", "gripper")
    if not frames:
        return {field: np.asarray(observation[field])[None][:0] for field in fields}  # type: ignore[literal-required]
    return {field: np.stack([frame[field] for frame in frames]) for field in fields}


def _subgoal(message: Message) -> str | None:
    found = message.get("grounded_subgoal") or message.get("simple_subgoal")
    return None if found is None else str(found)


def _since(start: float) -> float:
    return 1000 * (time.perf_counter() - start)
