"""Answers of a policy server to messages, whatever the transport."""

from __future__ import annotations

import time
from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping
from threading import Lock
from typing import Any, ClassVar, cast

import numpy as np
from numpy.typing import NDArray

from roboirg.core.actions import check_chunk
from roboirg.core.observations import Observation
from roboirg.core.policy_needs import PolicyNeeds
from roboirg.policies.contract.base import Policy, tell_policy
from roboirg.policies.remote.endpoints import MIB

Message = Mapping[str, Any]
Handler = Callable[[Message], dict[str, Any]]
"""Returns the reply to a message; whatever it raises goes to the client as a traceback."""
MakePolicy = Callable[[], Policy]

STATE_SIZE = 8
"""Seven joints and the first finger, as in openpi and MME-VLA."""
_PICTURE_AXES = 3
PICTURE_BYTES, DEPTH_BYTES = 256 * 256 * 3, 256 * 256 * 2
"""Of one camera at one step."""
MAX_STEPS_SHOWN = 1500
"""Control steps in one message: the longest video of the splits has 1187, and a policy may ask for
all that it did in an episode of the challenge."""


def request_limit(step_bytes: int) -> int:
    """Return the size in bytes that a message needs at most.

    Args:
        step_bytes: of the pictures of a step; everything else of it is far below 1 KiB.
    """
    return MIB + MAX_STEPS_SHOWN * (step_bytes + 1024)


class Service(ABC):
    """Answers messages with policies, one message at a time over all connections.

    Connections may be many and idle: make a policy with the first message, not before.

    Args:
        make_policy: makes a fresh policy.

    Attributes:
        make_policy: makes a fresh policy.
        max_request_bytes: size limit of a message; by default, that of a video with the pictures
            and depth of two cameras.
    """

    max_request_bytes: ClassVar[int] = request_limit(2 * (PICTURE_BYTES + DEPTH_BYTES))

    def __init__(self, make_policy: MakePolicy) -> None:
        self.make_policy = make_policy
        self._lock = Lock()

    def connection(self) -> Handler:
        """Return the handler of a new connection, under the lock of the service."""
        handle = self.new_handler()

        def handle_locked(message: Message) -> dict[str, Any]:
            with self._lock:
                return handle(message)

        return handle_locked

    @abstractmethod
    def new_handler(self) -> Handler:
        """Return the handler of a new connection; its calls never overlap."""


def act(policy: Policy, observation: Observation) -> tuple[NDArray[np.float64], float]:
    """Return a policy's actions, checked, and the milliseconds they took.

    Raises:
        InvalidActionError: the policy gave something else.
    """
    start = time.perf_counter()
    actions = check_chunk(policy.act(observation), PolicyNeeds.of(policy, "actions").action_space)
    return actions, 1000 * (time.perf_counter() - start)


def tell_change(policy: Policy, before: str, observation: Observation, step: int) -> str:
    """Let a policy hear what an observation says, if it differs from what was said before it.

    Args:
        policy: that remembers from one request to the next.
        before: the instruction of the observation before.
        observation: now.
        step: control steps that the client has shown since the policy's turn began.

    Returns:
        What the observation says.
    """
    said = observation["instruction"]
    if said != before:
        tell_policy(policy, [{"text": said, "step": step}])
    return said


def read_picture(message: Message, key: str) -> NDArray[np.uint8]:
    """Return a picture (H, W, 3) of a message.

    Raises:
        ValueError: there is none.
    """
    picture = np.asarray(message.get(key))
    if picture.dtype != np.uint8 or picture.ndim != _PICTURE_AXES or picture.shape[-1] != 3:  # noqa: PLR2004
        raise ValueError(f"{key!r} must be uint8 (H, W, 3); got {_describe(message.get(key))}.")
    return picture


def read_state(message: Message, key: str) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
    """Return joints (..., 7) and fingers (..., 2) of a state (..., 8).

    The state has one finger; the other is taken to be the same.

    Raises:
        ValueError: there is none.
    """
    state = np.asarray(message.get(key))
    if state.dtype.kind not in "fiu" or state.ndim < 1 or state.shape[-1] != STATE_SIZE:
        raise ValueError(
            f"{key!r} must hold {STATE_SIZE} real numbers; got {_describe(message.get(key))}."
        )
    numbers = state.astype(np.float32)
    return numbers[..., :-1], np.repeat(numbers[..., -1:], 2, axis=-1)


def read_text(message: Message, key: str) -> str:
    """Return a text of a message.

    Raises:
        ValueError: there is none.
    """
    text = message.get(key)
    if not isinstance(text, str):
        raise ValueError(f"{key!r} must be a text; got {_describe(text)}.")
    return text


def read_request(message: Message) -> Observation:
    """Return the observation in a request of openpi or MME-VLA; it has no end effector pose.

    Raises:
        ValueError: something is missing or malformed.
    """
    joints, gripper = read_state(message, "observation/state")
    observation: Any = {
        "front_rgb": read_picture(message, "observation/image"),
        "wrist_rgb": read_picture(message, "observation/wrist_image"),
        "joint_positions": joints,
        "gripper": gripper,
        "instruction": read_text(message, "prompt"),
    }
    return cast("Observation", observation)


def _describe(value: object) -> str:
    if isinstance(value, np.ndarray):
        return f"{value.dtype} {value.shape}"
    return "nothing" if value is None else type(value).__name__
