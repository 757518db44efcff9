"""The action space: one object that describes, checks and limits actions."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from roboirg.errors import InvalidActionError

ARM_JOINTS = 7
ACTION_SIZE = 8
"""Seven absolute joint targets (rad), then the gripper: +1 open, -1 closed."""

JOINT_LOW = np.array([-2.8973, -1.7628, -2.8973, -3.0718, -2.8973, -0.0175, -2.8973])
JOINT_HIGH = np.array([2.8973, 1.7628, 2.8973, -0.0698, 2.8973, 3.7525, 2.8973])
"""Joint limits of the Franka Panda, rad. Targets beyond them are accepted; the joints stop."""

ACTION_LOW = np.append(JOINT_LOW, -1.0)
ACTION_HIGH = np.append(JOINT_HIGH, 1.0)


def check_action(action: ArrayLike) -> NDArray[np.float64]:
    """The action as eight finite numbers.

    Raises:
        InvalidActionError: it is not numeric, not of shape (8,), or not finite.
    """
    return _finite(_numbers(action), (ACTION_SIZE,))


def check_chunk(actions: ArrayLike) -> NDArray[np.float64]:
    """A policy's answer as a chunk of shape (n, 8), n >= 1; one action alone is a chunk of one.

    Raises:
        InvalidActionError: it is not numeric, of another shape, or not finite.
    """
    numbers = _numbers(actions)
    chunk = numbers[None] if numbers.ndim == 1 else numbers
    if chunk.ndim != 2 or len(chunk) == 0:  # noqa: PLR2004
        raise InvalidActionError(_shape_message(numbers.shape))
    return _finite(chunk, (len(chunk), ACTION_SIZE))


def _numbers(action: ArrayLike) -> NDArray[np.float64]:
    try:
        numbers = np.asarray(action)
    except ValueError:  # rows of different lengths
        numbers = np.asarray(None)
    if numbers.dtype.kind not in "biuf":
        raise InvalidActionError(
            f"An action is an array of {ACTION_SIZE} real numbers; got {type(action).__name__}."
        )
    return numbers.astype(np.float64)


def _finite(numbers: NDArray[np.float64], shape: tuple[int, ...]) -> NDArray[np.float64]:
    if numbers.shape != shape:
        raise InvalidActionError(_shape_message(numbers.shape))
    bad = np.argwhere(~np.isfinite(numbers))
    if len(bad):
        raise InvalidActionError(
            f"Action value {bad[0][-1]} is {numbers[tuple(bad[0])]}; "
            "every value has to be a finite number."
        )
    return numbers


def _shape_message(shape: tuple[int, ...]) -> str:
    return (
        f"An action has shape ({ACTION_SIZE},), seven joint targets in rad and the gripper in "
        f"[-1, 1], or (n, {ACTION_SIZE}) as a chunk; got shape {shape}."
    )
