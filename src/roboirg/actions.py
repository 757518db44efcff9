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

_CONTENT = f"shape ({ACTION_SIZE},), seven joint targets in rad and the gripper in [-1, 1]"

ACTION_LOW = np.append(JOINT_LOW, -1.0)
ACTION_HIGH = np.append(JOINT_HIGH, 1.0)


def check_action(action: ArrayLike) -> NDArray[np.float64]:
    """The action as eight finite numbers.

    Raises:
        InvalidActionError: it is not numeric, not of shape (8,), or not finite.
    """
    numbers = _numbers(action)
    if numbers.shape != (ACTION_SIZE,):
        raise InvalidActionError(f"An action has {_CONTENT}; got shape {numbers.shape}.")
    return _finite(numbers)


def check_chunk(actions: ArrayLike) -> NDArray[np.float64]:
    """A policy's answer as a chunk of shape (n, 8), n >= 1; one action alone is a chunk of one.

    Raises:
        InvalidActionError: it is not numeric, of another shape, or not finite.
    """
    numbers = _numbers(actions)
    chunk = numbers[None] if numbers.ndim == 1 else numbers
    if chunk.ndim != 2 or chunk.shape[1] != ACTION_SIZE or len(chunk) == 0:  # noqa: PLR2004
        raise InvalidActionError(
            f"A chunk of actions has shape (n, {ACTION_SIZE}), n >= 1; an action has {_CONTENT}; "
            f"got shape {numbers.shape}."
        )
    return _finite(chunk)


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


def _finite(numbers: NDArray[np.float64]) -> NDArray[np.float64]:
    bad = np.argwhere(~np.isfinite(numbers))
    if len(bad):
        raise InvalidActionError(
            f"Action value {bad[0][-1]} is {numbers[tuple(bad[0])]}; "
            "every value has to be a finite number."
        )
    return numbers
