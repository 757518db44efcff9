"""What a policy gets to see: which pictures, one moment, and what was shown before."""

from __future__ import annotations

from typing import Any, NotRequired, TypedDict

import numpy as np
from numpy.typing import NDArray

from roboirg.errors import InvalidValueError, UnknownNameError

CAMERAS = ("front", "wrist")


def check_cameras(cameras: object) -> tuple[str, ...]:
    """The names of cameras that somebody asks for.

    Raises:
        InvalidValueError: it is no tuple or list, or names a camera twice.
        UnknownNameError: there is no such camera.
    """
    if isinstance(cameras, str):
        raise InvalidValueError(f"cameras is the text {cameras!r}; write ({cameras!r},).")
    if not isinstance(cameras, tuple | list):
        raise InvalidValueError(
            f"cameras is of type {type(cameras).__name__}; it has to be a tuple such as "
            "('front',) or ()."
        )
    for camera in cameras:
        if camera not in CAMERAS:
            raise UnknownNameError("camera", camera, CAMERAS)
        if cameras.count(camera) > 1:
            raise InvalidValueError(f"cameras names {camera!r} twice.")
    return tuple(cameras)


class Observation(TypedDict):
    """What the robot sees and feels now.

    Pictures are uint8 (256, 256, 3), present for the cameras that the policy asks for. Depth and
    calibration are there for the same cameras if the environment was made with ``depth=True``,
    ``calibration=True``.
    """

    front_rgb: NDArray[np.uint8]
    wrist_rgb: NDArray[np.uint8]
    joint_positions: NDArray[np.float32]
    """(7,) arm joint angles, rad."""
    gripper: NDArray[np.float32]
    """(2,) finger positions, m, 0 to 0.04."""
    end_effector: NDArray[np.float64]
    """(6,) x, y, z (m) and roll, pitch, yaw (rad, extrinsic x-y-z) of the tool centre, world."""
    instruction: str
    front_depth: NotRequired[NDArray[np.int16]]
    """(256, 256, 1) distance along the viewing direction, mm; 0 where nothing is seen."""
    wrist_depth: NotRequired[NDArray[np.int16]]
    front_extrinsic: NotRequired[NDArray[np.float32]]
    """(3, 4) from the world's frame to the camera's (OpenCV: x right, y down, z forward)."""
    wrist_extrinsic: NotRequired[NDArray[np.float32]]
    front_intrinsic: NotRequired[NDArray[np.float32]]
    """(3, 3) from the camera's frame to pixels."""
    wrist_intrinsic: NotRequired[NDArray[np.float32]]


Demonstration = dict[str, NDArray[Any]]
"""As `Observation` without the instruction, one more leading axis T: what was shown before.

T is 0 in tasks without a video. The frame that follows it is the first observation.
"""
