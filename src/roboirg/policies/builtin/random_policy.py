"""The random policy: valid but meaningless actions."""

from __future__ import annotations

import zlib
from collections.abc import Mapping
from typing import ClassVar

import numpy as np

from roboirg.core.actions import ARM_JOINTS, JOINT_HIGH, JOINT_LOW, Actions
from roboirg.core.observations import Demonstration, Observation
from roboirg.policies.builtin.scripted import WORDLESS

CHUNK = 16
"""Actions in a chunk."""
MAX_STEP = 0.045
"""Radians per control step: 0.9 rad/s, the speed limit of the scripted expert."""


class RandomPolicy:
    """Moves toward random joint positions, and opens and closes the gripper."""

    cameras: ClassVar[tuple[str, ...]] = ()
    metadata: ClassVar[Mapping[str, str]] = {
        **WORDLESS,
        "reads_text": "no, but the text and the policy seed start its random numbers",
    }

    def __init__(self, seed: int = 0) -> None:
        self.seed = seed

    def reset(self, instruction: str, demonstration: Demonstration) -> None:  # noqa: ARG002
        """Begin a random walk that depends on the seed and the instruction alone."""
        self._rng = np.random.default_rng([self.seed, zlib.crc32(instruction.encode())])

    def act(self, observation: Observation) -> Actions:
        """Return actions (`CHUNK`, 8) toward random joint angles, with a random gripper value.

        All of them make the same step, of at most `MAX_STEP` a joint, so a far target is not
        reached.
        """
        joints = np.asarray(observation["joint_positions"], dtype=np.float64)
        target = self._rng.uniform(JOINT_LOW, JOINT_HIGH)  # rad, (7,)
        step = np.clip((target - joints) / CHUNK, -MAX_STEP, MAX_STEP)
        steps_made = np.arange(1, CHUNK + 1)[:, None]
        path = joints + step * steps_made
        gripper = self._rng.uniform(-1.0, 1.0)
        actions = np.column_stack([path, np.full(CHUNK, gripper)])
        actions[:, :ARM_JOINTS] = np.clip(actions[:, :ARM_JOINTS], JOINT_LOW, JOINT_HIGH)
        return actions
