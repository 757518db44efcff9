"""The interface of robots for `roboirg real run`.

Frames and units are those of the benchmark's observations. The world frame lies `ROBOT_BASE` in
front of the robot's base, with the same axes: x forward, y to the robot's left, z up.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple, Protocol, runtime_checkable

import numpy as np
from numpy.typing import NDArray

from roboirg.apps.real.control.clock import Clock
from roboirg.evaluation.play.rollout_result import RolloutResult
from roboirg.evaluation.records.record import Job

CAMERA_RATE = 30.0
"""Pictures per second of each camera (paper)."""
COMMAND_RATE = 20.0
"""Commands per second.

The rate of the benchmark's actions, so that the same policy acts in simulation and here, and a
chunk of 20 is one second in both. Slower than the cameras: in every control period each of them
has a new picture.
"""
HORIZON = 20
"""Actions of a chunk that are executed before the policy gets a new observation (paper)."""

Command = NDArray[np.float64]
"""(8,): absolute joint targets, rad, and the gripper, +1 open to -1 closed."""


class SensorReading(NamedTuple):
    """The newest sensor values of a robot.

    Attributes:
        fields: as in a policy's observation, without the instruction.
        taken: time of each camera's newest picture, seconds on the robot's clock.
    """

    fields: Mapping[str, Any]
    taken: Mapping[str, float]

    @property
    def joints(self) -> NDArray[np.float64]:
        """The arm's joint angles (7), rad."""
        return np.asarray(self.fields["joint_positions"], dtype=np.float64)


class Robot(Protocol):
    """An arm with seven joints and a gripper, a front and a wrist camera.

    No call may take longer than a control period, except `connect`, `prepare` and `close`.

    Attributes:
        name: for records.
        rate: commands per second.
        clock: gives the times in `SensorReading.taken`.
    """

    name: str
    rate: float
    clock: Clock

    def connect(self) -> None:
        """Connect; the arm does not move."""

    def prepare(self, job: Job, cameras: Sequence[str]) -> None:
        """Prepare a trial: return with the table arranged and the arm at home and at rest.

        Args:
            job: the trial.
            cameras: names of the cameras that the policy uses.
        """

    def observe(self) -> SensorReading:
        """Return the newest sensor values, without waiting for a camera."""

    def command(self, command: Command) -> None:
        """Move toward joint targets for one control period."""

    def stop(self) -> None:
        """Hold the position and the gripper as they are. May be called again."""

    def close(self) -> None:
        """Stop and disconnect."""


@runtime_checkable
class JudgingRobot(Protocol):
    """A robot that judges trials itself: the twin."""

    def is_over(self) -> bool:
        """Return whether there is a verdict."""

    def judge(self, result: RolloutResult) -> None:
        """Fill in the verdict and the events of the trial."""
