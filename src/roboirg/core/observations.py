"""Observations: cameras, the data of one step, and the demonstration."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from typing import Any, Literal, NotRequired, TypedDict

import numpy as np
from numpy.typing import NDArray

from roboirg.core.errors import InvalidValueError, check_names

FRONT = "front"
WRIST = "wrist"
CAMERAS = (FRONT, WRIST)

PICTURE_SIZE = 256
"""Width and height of the pictures in observations, pixels: of both cameras, and of depth."""

DemonstrationSource = Literal["none", "recorded", "planned"]
"""Who moves the robot in a demonstration: RoboMME's recorded actions, or the oracle; ``none``
without a demonstration."""


def check_cameras(cameras: object) -> tuple[str, ...]:
    """Return a value as a tuple of names of cameras: ``["front"]`` -> ``("front",)``.

    Raises:
        InvalidValueError: it is no tuple or list, or names a camera twice.
        UnknownNameError: there is no such camera.
    """
    if isinstance(cameras, str):
        raise InvalidValueError(f"cameras is the text {cameras!r}; write ({cameras!r},).")
    if not isinstance(cameras, tuple | list):
        raise InvalidValueError(
            f"cameras is of type {type(cameras).__name__}; it must be a tuple such as "
            "('front',) or ()."
        )
    check_names("camera", cameras, CAMERAS)
    for camera in cameras:
        if cameras.count(camera) > 1:
            raise InvalidValueError(f"cameras names {camera!r} twice.")
    return tuple(cameras)


Pixels = NDArray[np.uint8]
"""A picture, (H, W, 3), RGB."""


class Observation(TypedDict):
    """Camera images, robot state and instruction of one step.

    Images are uint8 (256, 256, 3), present for the cameras that the policy requires. Depth and
    calibration are present for the same cameras if the environment was made with ``depth=True``,
    ``calibration=True``.
    """

    front_rgb: Pixels
    wrist_rgb: Pixels
    joint_positions: NDArray[np.float32]
    """(7,) arm joint angles, rad."""
    gripper: NDArray[np.float32]
    """(2,) finger positions, m, 0 to 0.04."""
    end_effector: NDArray[np.float64]
    """(6,) x, y, z (m) and roll, pitch, yaw (rad, extrinsic x-y-z) of the tool center, world."""
    instruction: str
    front_depth: NotRequired[NDArray[np.int16]]
    """(256, 256, 1) distance along the viewing direction, mm; 0 where nothing is in view."""
    wrist_depth: NotRequired[NDArray[np.int16]]
    front_extrinsic: NotRequired[NDArray[np.float32]]
    """(3, 4) from the world's frame to the camera's (OpenCV: x right, y down, z forward)."""
    wrist_extrinsic: NotRequired[NDArray[np.float32]]
    front_intrinsic: NotRequired[NDArray[np.float32]]
    """(3, 3) from the camera's frame to pixels."""
    wrist_intrinsic: NotRequired[NDArray[np.float32]]
    history: NotRequired[tuple[Observation, ...]]
    """With ``observe_every=n``: the observations after every n-th control step since the last."""


Demonstration = Mapping[str, NDArray[Any]]
"""The video: as `Observation` without instruction and history, with a leading axis T.

T is 0 in tasks without a video. The first observation follows the last frame. Images are rendered
when they are first read, and then kept; images that are not read cost no time.
"""


class FetchedDemonstration(Mapping[str, NDArray[Any]]):
    """A demonstration; fields that are not here are fetched when they are read, and kept.

    To read several, call `draw` first, which fetches them together.

    Args:
        fields: names of all fields.
        arrays: those that are already here.
        fetch: returns other fields.
    """

    def __init__(
        self,
        fields: Sequence[str],
        arrays: Demonstration,
        fetch: Callable[[Sequence[str]], Demonstration],
    ) -> None:
        self._fields = tuple(fields)
        self._arrays = dict(arrays)
        self._fetch = fetch

    @property
    def length(self) -> int:
        """Control steps in the video, T; ``len`` is the number of fields."""
        return len(self["joint_positions"])

    def __getitem__(self, field: str) -> NDArray[Any]:
        """Return a field; raises KeyError if it does not exist."""
        if field not in self._arrays and field in self._fields:
            self._arrays.update(self._fetch([field]))
        return self._arrays[field]

    def draw(self) -> None:
        """Fetch all fields that are not here."""
        missing = [field for field in self._fields if field not in self._arrays]
        if missing:
            self._arrays.update(self._fetch(missing))

    def __contains__(self, field: object) -> bool:
        return field in self._fields

    def __iter__(self) -> Iterator[str]:
        return iter(self._fields)

    def __len__(self) -> int:
        return len(self._fields)

    def __reduce__(self) -> tuple[type[Mapping[str, Any]], tuple[Any, ...]]:
        self.draw()
        return dict, (dict(self),)


def proprioception(seen: Mapping[str, Any]) -> NDArray[np.float32]:
    """Return the state as openpi, MME-VLA and our LeRobot datasets define it.

    Args:
        seen: an observation, or a demonstration of T steps, of which it reads `joint_positions`
            ((7,) or (T, 7), rad) and `gripper` ((2,) or (T, 2), finger positions in m).

    Returns:
        The joints and the first finger, (8,) or (T, 8).
    """
    state: NDArray[np.float32] = np.concatenate(
        [seen["joint_positions"], seen["gripper"][..., :1]], axis=-1, dtype=np.float32
    )
    return state
