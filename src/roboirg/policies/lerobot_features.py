"""Names and units of what LeRobot stores of an arm: of a robot, and in the datasets it records."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from roboirg.core.actions import ARM_JOINTS
from roboirg.policies.contract.policy_urls import UrlOptions

SIZE = 256
"""Width and height of the pictures in observations, pixels."""
FINGER_RANGE = 0.04
"""Largest opening of each finger, m."""


class LeRobotFeatures(UrlOptions):
    """Names and units, after ``?`` in the spec of a robot or a dataset.

    Attributes:
        joint: name of a joint's position in observations and actions; ``{}`` is 1 to 7.
        gripper: name of the gripper's position.
        gripper_closed: its value when closed.
        gripper_open: its value when open.
        degrees: whether joints are in degrees rather than radians.
        front: name of the front picture.
        wrist: name of the wrist picture.
    """

    joint: str = "joint_{}.pos"
    gripper: str = "gripper.pos"
    gripper_closed: float = 0.0
    gripper_open: float = 1.0
    degrees: bool = False
    front: str = "front"
    wrist: str = "wrist"

    @property
    def joints(self) -> tuple[str, ...]:
        """The names of the arm's joints."""
        return tuple(self.joint.format(number) for number in range(1, ARM_JOINTS + 1))

    @property
    def vector(self) -> tuple[str, ...]:
        """The names of the joints and the gripper."""
        return (*self.joints, self.gripper)

    @property
    def unit(self) -> float:
        """One radian in the robot's unit."""
        return math.degrees(1.0) if self.degrees else 1.0

    def opening(self, gripper: Any) -> Any:  # noqa: ANN401 - a number or an array
        """Return how far the gripper is open: 0 closed, 1 open."""
        return (gripper - self.gripper_closed) / (self.gripper_open - self.gripper_closed)


def scaled_square(picture: NDArray[Any], size: int = SIZE, *, smooth: bool = True) -> NDArray[Any]:
    """Crop a picture to its central square and scale it to `size` x `size` pixels."""
    import cv2

    height, width = picture.shape[:2]
    side = min(height, width)
    top, left = (height - side) // 2, (width - side) // 2
    square = picture[top : top + side, left : left + side]
    method = cv2.INTER_AREA if smooth else cv2.INTER_NEAREST
    return np.asarray(cv2.resize(square, (size, size), interpolation=method))
