"""What a server makes of messages, whatever transports them."""

from __future__ import annotations

import time
from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping
from threading import Lock
from typing import Any, cast

import numpy as np
from numpy.typing import NDArray

from roboirg.core.actions import check_chunk
from roboirg.core.observations import Observation
from roboirg.policies.base import Policy
from roboirg.policies.requirements import (
    wanted_actions,
)

Message = Mapping[str, Any]
Answer = Callable[[Message], dict[str, Any]]
MakePolicy = Callable[[], Policy]

STATE_SIZE = 8
"""Seven joints and the first finger, as openpi and MME-VLA have it."""
_PICTURE_AXES = 3


class Service(ABC):
    """Answers messages with policies; one message at a time, whoever sends it.

    Args:
        make: makes a fresh policy.
    """

    def __init__(self, make: MakePolicy) -> None:
        self._make = make
        self._lock = Lock()

    def connection(self) -> Answer:
        """What answers the messages of a new connection."""
        answer = self.open()

        def in_turn(message: Message) -> dict[str, Any]:
            with self._lock:
                return answer(message)

        return in_turn

    @abstractmethod
    def open(self) -> Answer:
        """What answers the messages of a new connection, called one at a time."""


def act(policy: Policy, observation: Observation) -> tuple[NDArray[np.float64], float]:
    """A policy's actions, checked, and the milliseconds that they took.

    Raises:
        InvalidActionError: the policy gave something else.
    """
    start = time.perf_counter()
    actions = check_chunk(policy.act(observation), wanted_actions(policy))
    return actions, 1000 * (time.perf_counter() - start)


def finish(policy: Policy | None) -> None:
    """Tell a policy that its episode is over, if it wants to know."""
    close = getattr(policy, "close", None)
    if callable(close):
        close()


def read_picture(message: Message, key: str) -> NDArray[np.uint8]:
    """A picture (H, W, 3).

    Raises:
        ValueError: there is none.
    """
    picture = np.asarray(message.get(key))
    if picture.dtype != np.uint8 or picture.ndim != _PICTURE_AXES or picture.shape[-1] != 3:  # noqa: PLR2004
        raise ValueError(f"{key!r} has to be uint8 (H, W, 3); got {_describe(message.get(key))}.")
    return picture


def read_state(message: Message, key: str) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
    """Joints (..., 7) and fingers (..., 2) in a state (..., 8); both fingers are taken to agree.

    Raises:
        ValueError: there is none.
    """
    state = np.asarray(message.get(key))
    if state.dtype.kind not in "fiu" or state.ndim < 1 or state.shape[-1] != STATE_SIZE:
        raise ValueError(
            f"{key!r} has to hold {STATE_SIZE} real numbers; got {_describe(message.get(key))}."
        )
    numbers = state.astype(np.float32)
    return numbers[..., :-1], np.repeat(numbers[..., -1:], 2, axis=-1)


def read_text(message: Message, key: str) -> str:
    """A text.

    Raises:
        ValueError: there is none.
    """
    text = message.get(key)
    if not isinstance(text, str):
        raise ValueError(f"{key!r} has to be a text; got {_describe(text)}.")
    return text


def read_request(message: Message) -> Observation:
    """The observation in a request of openpi and MME-VLA, which tell no end effector's pose.

    Raises:
        ValueError: something is missing or malformed.
    """
    joints, gripper = read_state(message, "observation/state")
    seen: Any = {
        "front_rgb": read_picture(message, "observation/image"),
        "wrist_rgb": read_picture(message, "observation/wrist_image"),
        "joint_positions": joints,
        "gripper": gripper,
        "instruction": read_text(message, "prompt"),
    }
    return cast("Observation", seen)


def _describe(value: object) -> str:
    if isinstance(value, np.ndarray):
        return f"{value.dtype} {value.shape}"
    return "nothing" if value is None else type(value).__name__
