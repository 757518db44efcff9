"""Limits of commands, checked before a command is sent."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from pydantic import BaseModel, ConfigDict, Field, ValidationError

from roboirg.apps.real.control.robot import Command
from roboirg.core.actions import ARM_JOINTS, JOINT_HIGH, JOINT_LOW
from roboirg.core.errors import InvalidActionError, InvalidValueError
from roboirg.core.kinematics import tool_pose

FR3_LOW = np.array([-2.7437, -1.7837, -2.9007, -3.0421, -2.8065, 0.5445, -3.0159])
FR3_HIGH = np.array([2.7437, 1.7837, 2.9007, -0.1518, 2.8065, 4.5169, 3.0159])
"""Joint limits of the Franka Research 3, rad (its maker's data sheet)."""
LOW, HIGH = np.maximum(JOINT_LOW, FR3_LOW), np.minimum(JOINT_HIGH, FR3_HIGH)
"""Joint limits that hold for both the Panda and the Research 3, rad."""

SLACK = 1e-9
_AXES = ("x", "y", "z")


class Limits(BaseModel):
    """Limits of commands and times.

    Attributes:
        joint_speed: largest of every joint, rad/s. Below the slowest joint of the Panda (2.175) and
            of the Research 3 (2.62); the benchmark's demonstrations stay below 0.9.
        workspace_low: smallest x, y, z of the tool center, robot base frame, m.
        workspace_high: largest x, y, z.
        picture_age_s: largest of each camera's newest picture; one and a half camera periods.
        policy_timeout_s: longest time for a chunk; the arm holds its position meanwhile.
        watchdog_timeout_s: how long the control loop may hang before the arm is stopped.
    """

    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False)

    joint_speed: float = Field(default=1.5, gt=0)
    workspace_low: tuple[float, float, float] = (0.2, -0.5, 0.002)
    workspace_high: tuple[float, float, float] = (0.9, 0.5, 0.8)
    picture_age_s: float = Field(default=0.05, gt=0)
    policy_timeout_s: float = Field(default=2.0, gt=0)
    watchdog_timeout_s: float = Field(default=0.1, gt=0)

    def check(
        self,
        command: Command,
        last: NDArray[np.float64],
        joints: NDArray[np.float64],
        period_s: float,
    ) -> None:
        """Refuse a command outside the limits.

        A joint's speed is measured from its last target or its present angle, whichever is nearer:
        an arm lags behind its targets, and a policy may start from the observed angles.

        Args:
            command: joint targets and gripper.
            last: previous joint targets (7), rad.
            joints: present joint angles (7), rad.
            period_s: time between two commands.

        Raises:
            InvalidActionError: the command is outside the limits and must not be sent.
        """
        target = command[:ARM_JOINTS]
        outside = np.flatnonzero((target < LOW - SLACK) | (target > HIGH + SLACK))
        if len(outside):
            joint = int(outside[0])
            raise InvalidActionError(
                f"joint {joint + 1} would go to {target[joint]:.3f} rad; its limits are "
                f"{LOW[joint]:.3f} and {HIGH[joint]:.3f}."
            )
        nearest = np.clip(target, np.minimum(last, joints), np.maximum(last, joints))
        speeds = np.abs(target - nearest) / period_s
        fastest = int(np.argmax(speeds))
        if speeds[fastest] > self.joint_speed + SLACK:
            raise InvalidActionError(
                f"joint {fastest + 1} would move at {speeds[fastest]:.2f} rad/s; at most "
                f"{self.joint_speed:g}."
            )
        self._check_tool(tool_pose(target)[:3, 3])

    def _check_tool(self, tool: NDArray[np.float64]) -> None:
        for axis, low, at, high in zip(
            _AXES, self.workspace_low, tool, self.workspace_high, strict=True
        ):
            if not low - SLACK <= at <= high + SLACK:
                raise InvalidActionError(
                    f"the tool would go to {axis} = {at:.3f} m in the robot's base frame; the "
                    f"workspace is from {low:g} to {high:g}."
                )


def read_limits(path: Path | None) -> Limits:
    """Read limits from a JSON file; fields that it leaves out have their defaults.

    Args:
        path: None for all defaults.

    Raises:
        InvalidValueError: the file cannot be read or is malformed.
    """
    if path is None:
        return Limits()
    try:
        return Limits.model_validate_json(path.read_bytes())
    except OSError as error:
        raise InvalidValueError(f"Cannot read the limits {path}: {error.strerror}.") from error
    except ValidationError as error:
        first = error.errors()[0]
        name = ".".join(str(part) for part in first["loc"]) or "the file"
        raise InvalidValueError(f"The limits {path}: {name}: {first['msg']}.") from error
