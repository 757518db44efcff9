"""The policy contract: what the benchmark calls and what it gets back."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Protocol, TypedDict, runtime_checkable

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    from roboirg.environment import RoboIRGEnv


class Observation(TypedDict):
    """What the robot sees and feels now.

    Pictures are uint8 (256, 256, 3), present for the cameras that the policy asks for.
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


Demonstration = dict[str, NDArray[Any]]
"""As `Observation` without the instruction, one more leading axis T: what was shown before.

T is 0 in tasks without a video. The frame that follows it is the first observation.
"""


@runtime_checkable
class Policy(Protocol):
    """Anything that turns observations into actions.

    Set the class attribute ``cameras`` to the pictures that are wanted, for example ``()``;
    by default every observation holds both.
    """

    def reset(self, instruction: str, demonstration: Demonstration) -> None:
        """A new episode begins."""

    def act(self, observation: Observation) -> NDArray[np.floating[Any]]:
        """The next actions, shape (n, 8), n >= 1; all are executed before the next call."""


@runtime_checkable
class PrivilegedPolicy(Policy, Protocol):
    """A policy that looks behind the scenes; it says so by having ``attach``."""

    def attach(self, env: RoboIRGEnv) -> None:
        """The environment of the episode that is about to begin, called before ``reset``."""
