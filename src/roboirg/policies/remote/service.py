"""Answers of a policy server to messages."""

from __future__ import annotations

import time
from abc import ABC, abstractmethod
from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import Any, ClassVar, Literal, cast

import numpy as np
from numpy.typing import NDArray

from roboirg.core.actions import check_chunk
from roboirg.core.observations import Demonstration, Observation
from roboirg.core.policy_needs import PolicyNeeds
from roboirg.policies.contract.base import Policy, close_policy, tell_policy
from roboirg.policies.remote.endpoints import MIB

Message = Mapping[str, Any]
"""Names and values, as the codec has read them."""
NumberType = Literal["uint8", "real numbers"]
_REAL_KINDS = "fiu"
"""NumPy's letters for the dtypes of real numbers: floats, and integers with and without a sign."""


class Service(ABC):
    """Answers messages with a policy, one message at a time over all connections.

    Subclasses define `handle`, in which they call `begin` for a new episode, `hear` and `act`.
    Whatever it raises goes to the client as a traceback.

    Args:
        make_policy: makes a fresh policy.

    Attributes:
        max_request_bytes: size limit of a message; by default, that of the longest video (1187
            steps; an episode of the challenge may have 1500) with the pictures and depth of two
            cameras.
        policy: of the episode; None between episodes.
        said: what it heard last.
    """

    max_request_bytes: ClassVar[int] = 940 * MIB

    def __init__(self, make_policy: Callable[[], Policy]) -> None:
        self.make_policy = make_policy
        self.policy: Policy | None = None
        self.said = ""

    def connection(self) -> Service:
        """Return what answers a new connection: by default this, with one memory for all."""
        return self

    @abstractmethod
    def handle(self, message: Message) -> dict[str, Any]:
        """Return the reply to a message; calls never overlap."""

    def begin(self, instruction: str, demonstration: Demonstration) -> None:
        """Begin an episode; a policy is made only here, as connections may be many and idle."""
        self.policy = self.policy or self.make_policy()
        self.policy.reset(instruction, demonstration)
        self.said = instruction

    def hear(self, said: str, step: int) -> None:
        """Let the policy hear what the client says, if it differs from what was said before.

        Args:
            said: the instruction of an observation.
            step: control steps that the client has shown since the policy's turn began.
        """
        if said != self.said:
            tell_policy(self.policy, said, step)
        self.said = said

    def act(self, observation: Observation) -> tuple[NDArray[np.float64], float]:
        """Return the policy's actions, checked, and the milliseconds they took.

        Raises:
            InvalidActionError: the policy gave something else.
        """
        start = time.perf_counter()
        policy = cast("Policy", self.policy)
        space = PolicyNeeds.of(policy, "actions").action_space
        actions = check_chunk(policy.act(observation), space)
        return actions, 1000 * (time.perf_counter() - start)

    def forget(self) -> None:
        """End the episode; the next one gets a fresh policy."""
        close_policy(self.policy)
        self.policy = None


def read_array(
    message: Message, key: str, numbers: NumberType, shape: tuple[int | str, ...]
) -> Any:  # noqa: ANN401
    """Return an array of a message; raise if it has another type or shape than it must have.

    Args:
        message: that holds it.
        key: its name.
        numbers: what it must hold: bytes of pictures, or any real numbers.
        shape: with letters where any length will do, such as ``("T", 8)``.

    Raises:
        ValueError: it is missing, or has another shape or type; the client is shown the message.
    """
    array = np.asarray(message.get(key))
    if numbers == "uint8":
        has_numbers = array.dtype == np.uint8
    else:
        has_numbers = array.dtype.kind in _REAL_KINDS
    if not has_numbers or not _fits(array.shape, shape):
        wanted = ", ".join(map(str, shape))
        got = "nothing" if message.get(key) is None else f"{array.dtype} {array.shape}"
        raise ValueError(f"{key!r} must be {numbers} ({wanted}); got {got}.")
    return array


def _fits(sizes: tuple[int, ...], shape: tuple[int | str, ...]) -> bool:
    """Return whether sizes fit a shape: (5, 8) fits ("T", 8), as a letter stands for any size."""
    if len(sizes) != len(shape):
        return False
    for size, wanted in zip(sizes, shape, strict=True):
        if isinstance(wanted, int) and wanted != size:
            return False
    return True


def split_state(state: NDArray[Any]) -> dict[str, NDArray[np.float32]]:
    """Return joints (..., 7) and fingers (..., 2) of a state (..., 8).

    The state has one finger; the other is taken to be the same.
    """
    numbers = state.astype(np.float32)
    fingers = np.repeat(numbers[..., -1:], 2, axis=-1)
    return {"joint_positions": numbers[..., :-1], "gripper": fingers}


def stack_video(
    frames: Sequence[Mapping[str, NDArray[Any]]], observation: Observation, fields: Iterable[str]
) -> Demonstration:
    """Return the frames before a policy's turn as a demonstration, by field, arrays (T, ...).

    Without frames T is 0; `observation` gives the other sizes.
    """
    demonstration: dict[str, NDArray[Any]] = {}
    for field in fields:
        if frames:
            demonstration[field] = np.stack([frame[field] for frame in frames])
        else:
            one_frame = np.asarray(observation[field])[None]  # type: ignore[literal-required]
            demonstration[field] = one_frame[:0]
    return demonstration


def read_request(message: Message) -> Observation:
    """Return the observation in a request of openpi or MME-VLA; it has no end effector pose.

    Raises:
        ValueError: something is missing or malformed.
    """
    state = read_array(message, "observation/state", "real numbers", (8,))
    observation: Any = {
        **split_state(state),
        "front_rgb": read_array(message, "observation/image", "uint8", ("H", "W", 3)),
        "wrist_rgb": read_array(message, "observation/wrist_image", "uint8", ("H", "W", 3)),
        "instruction": str(message["prompt"]),
    }
    return cast("Observation", observation)
