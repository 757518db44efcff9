"""The action spaces: the numbers of an action, their limits, and checks."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from decimal import Decimal
from numbers import Real
from types import NoneType
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from roboirg.core.errors import InvalidActionError, check_names
from roboirg.core.plain_text import clip_text

Actions = NDArray[np.floating[Any]]
"""One action, or a chunk of several, one a row."""
CheckedActions = NDArray[np.float64]
"""The same, as the world executes them: finite, float64."""
ARM_JOINTS = 7
POSE_SIZE = 6
"""x, y, z, roll, pitch, yaw."""

JOINT_LOW = np.array([-2.8973, -1.7628, -2.8973, -3.0718, -2.8973, -0.0175, -2.8973])
JOINT_HIGH = np.array([2.8973, 1.7628, 2.8973, -0.0698, 2.8973, 3.7525, 2.8973])
"""Joint limits of the Franka Panda, rad. Targets beyond them are accepted; joints stop there."""

REACH_LOW = np.array([-1.7, -1.1, 0.0])
REACH_HIGH = np.array([0.5, 1.1, 1.4])
"""Box around all points above the table that the tool reaches, world frame, m."""


class ActionSpace(NamedTuple):
    """One way to command the robot.

    Attributes:
        name: the name in policies and environments.
        low: smallest sensible value of each number; smaller ones are accepted.
        high: largest sensible value of each number.
        describe: the numbers in words.
        takes_many_steps: whether one action takes many control steps.
    """

    name: str
    low: NDArray[np.float64]
    high: NDArray[np.float64]
    describe: str
    takes_many_steps: bool = False

    @property
    def size(self) -> int:
        """Number of values in an action."""
        return len(self.low)


JOINT_ANGLE = ActionSpace(
    "joint_angle",
    np.append(JOINT_LOW, -1.0),
    np.append(JOINT_HIGH, 1.0),
    "seven joint targets in rad and the gripper in [-1, 1]",
)
"""Absolute joint targets, then the gripper: +1 open, -1 closed; one control step."""

_POSE_LOW = np.concatenate([REACH_LOW, np.full(3, -math.pi), [-1.0]])
_POSE_HIGH = np.concatenate([REACH_HIGH, np.full(3, math.pi), [1.0]])
_POSE = "x, y, z in m, roll, pitch, yaw in rad and the gripper"

EE_POSE = ActionSpace("ee_pose", _POSE_LOW, _POSE_HIGH, f"{_POSE} in [-1, 1]")
"""Pose of the tool center, world frame, extrinsic x-y-z angles; one control step."""

WAYPOINT = ActionSpace(
    "waypoint",
    _POSE_LOW,
    _POSE_HIGH,
    f"{_POSE}, -1 to close it, +1 to open it",
    takes_many_steps=True,
)
"""The same pose, reached by a straight move of many steps; then the gripper closes or opens."""

_NO_NUMBERS = bool, np.bool_, NoneType, Decimal, np.ma.core.MaskedConstant
"""What stands in lists of others for a number, and is none."""
_REAL_KINDS = "iuf"
"""NumPy's letters for whole numbers with and without a sign, and for floating-point numbers."""
_MOST_SHOWN = 80
"""Characters of a value in an error message."""
NO_POINT = -1.0
CHOICE = ActionSpace(
    "choice",
    np.array([0.0, NO_POINT, NO_POINT]),
    np.array([3.0, 255.0, 255.0]),
    f"the number of a choice (a is 0), row and column of a point or {NO_POINT:g}, {NO_POINT:g}",
    takes_many_steps=True,
)
"""RoboMME's multi-choice mode: one of the task's motions, and a point of the front picture."""

ACTION_SPACES: Mapping[str, ActionSpace] = {
    space.name: space for space in (JOINT_ANGLE, EE_POSE, WAYPOINT, CHOICE)
}


def choice_action(label: str, point: tuple[float, float] | None = None) -> CheckedActions:
    """Return the action of a choice: its letter as a number, then row and column of its point.

    ``"b", (120, 80)`` -> ``[1, 120, 80]``; ``"b"``, which needs no point -> ``[1, -1, -1]``. Raises
    InvalidActionError if the label is no single letter.
    """
    if len(label) != 1 or not label.isascii() or not label.isalpha():
        raise InvalidActionError(f"Choice {label!r} is not a letter.")
    number = ord(label.lower()) - ord("a")
    if point is None:
        point = (NO_POINT, NO_POINT)
    return np.array([number, *point])


def find_action_space(name: object) -> ActionSpace:
    """Return the action space of that name; raises UnknownNameError if there is none."""
    check_names("action space", [name], ACTION_SPACES)
    return ACTION_SPACES[str(name)]


def check_action(action: ArrayLike, space: ActionSpace = JOINT_ANGLE) -> CheckedActions:
    """Return one action as an array of the space's size, ``(8,)`` for joint angles, in float64.

    Raises:
        InvalidActionError: it has another shape, or a value is not a finite number. Limits of the
            space are not checked.
    """
    numbers = _numbers(action, space)
    if numbers.shape != (space.size,):
        raise InvalidActionError(
            f"An action ({space.name}), {space.describe}: expected shape ({space.size},), "
            f"got shape {numbers.shape}."
        )
    return _finite(numbers)


def check_chunk(actions: ArrayLike, space: ActionSpace = JOINT_ANGLE) -> CheckedActions:
    """Return a policy's answer as a chunk (n, size), n >= 1; one action is a chunk of one.

    Shape ``(8,)`` -> ``(1, 8)``; ``(5, 8)`` stays.

    Raises:
        InvalidActionError: it has another shape, or a value is not a finite number.
    """
    numbers = _numbers(actions, space)
    chunk = numbers[None] if numbers.ndim == 1 else numbers  # one action becomes one row
    if chunk.ndim != 2 or chunk.shape[1] != space.size or len(chunk) == 0:  # noqa: PLR2004
        raise InvalidActionError(
            f"A chunk of actions ({space.name}), each {space.describe}: expected shape "
            f"(n, {space.size}) with n >= 1, got shape {numbers.shape}."
        )
    return _finite(chunk)


def _numbers(action: ArrayLike, space: ActionSpace) -> CheckedActions:
    """Return what a policy gave as an array of float64; `check_chunk` and others check its shape.

    Takes lists, and arrays of NumPy, PyTorch and JAX. Texts, flags, complex numbers, rows of
    different lengths and masked values are refused.

    Raises:
        InvalidActionError: it is no array of real numbers.
    """
    got = type(action).__name__
    if hasattr(action, "detach"):
        action = _as_numpy(action)
    try:
        numbers = np.asarray(action)
    except ValueError:
        numbers = np.asarray(None)  # no number either, so it is refused below
        got = "rows of different lengths"
    is_real = numbers.dtype.kind in _REAL_KINDS or numbers.dtype.name == "bfloat16"  # JAX's
    # NumPy turns the flags in a list into numbers; an array, which it returns as it is, has a type,
    # which says what is wrong unless it is the type of any Python object.
    is_typed = numbers is action and numbers.dtype.kind != "O"
    if numbers.ndim and not is_typed:
        values = np.ma.asarray(action, dtype=object)  # type: ignore[no-untyped-call]
        _check_values(values, is_real=is_real)
    if not is_real:
        if numbers.ndim:
            got += f" of dtype {numbers.dtype}"
        raise InvalidActionError(
            f"An action ({space.name}): expected an array of {space.size} real numbers, got {got}."
        )
    return numbers.astype(np.float64)


def _as_numpy(tensor: Any) -> NDArray[Any]:  # noqa: ANN401 - PyTorch need not be installed
    """Return a tensor of PyTorch as an array; NumPy takes none in bfloat16, or on a GPU, itself."""
    detached = tensor.detach().cpu()  # without its gradient
    if detached.is_floating_point():
        detached = detached.double()
    array: NDArray[Any] = detached.numpy()
    return array


def _check_values(values: NDArray[np.object_], *, is_real: bool) -> None:
    """Refuse the first value in a list that is no number, by its place.

    Args:
        values: Python objects.
        is_real: whether NumPy takes all of them for real numbers. It does so with flags and with
            what is behind a mask; of others, such as texts, there is then none.
    """
    for place, value in np.ma.ndenumerate(values, compressed=False):  # type: ignore[no-untyped-call]
        is_number = is_real or isinstance(value, Real)
        if isinstance(value, _NO_NUMBERS) or not is_number:
            raise _bad_value(place, clip_text(repr(value), _MOST_SHOWN))


def _finite(numbers: CheckedActions) -> CheckedActions:
    """Return the numbers if all of them are finite; raises `InvalidActionError` otherwise."""
    bad = np.argwhere(~np.isfinite(numbers))
    if len(bad):
        place = bad[0]
        raise _bad_value(place, str(numbers[tuple(place)]))
    return numbers


def _bad_value(place: Sequence[int] | NDArray[np.intp], shown: str) -> InvalidActionError:
    """Return the error of a value; its place is the index in an action or a chunk."""
    row = f" of row {place[0]}" if len(place) > 1 else ""
    return InvalidActionError(
        f"Action value {place[-1]}{row}: expected a finite number, got {shown}."
    )
