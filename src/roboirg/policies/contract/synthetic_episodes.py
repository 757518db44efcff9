"""Synthetic episodes, to check a policy without a simulator."""

from __future__ import annotations

from typing import Any, NamedTuple, cast

import numpy as np

from roboirg.core.actions import ARM_JOINTS, JOINT_HIGH, JOINT_LOW, REACH_HIGH, REACH_LOW
from roboirg.core.observations import PICTURE_SIZE, Observation
from roboirg.core.policy_needs import PolicyNeeds

PICTURE = (PICTURE_SIZE, PICTURE_SIZE, 3)
DEPTH = (PICTURE_SIZE, PICTURE_SIZE, 1)
DEEPEST_MM = 2000
"""Millimeters."""
_HALF = PICTURE_SIZE // 2
"""Row and column of the picture's center; and at 90 degrees the focal length."""
INTRINSIC = np.array([[_HALF, 0, _HALF], [0, _HALF, _HALF], [0, 0, 1]], np.float32)
"""From the camera's frame to pixels."""
_FINGER_RANGE = 0.04
"""Meters."""


class SyntheticEpisode(NamedTuple):
    """The inputs of a policy at the beginning of an episode.

    Attributes:
        instruction: the text.
        demonstration: the video, T steps.
        first: the first observation.
    """

    instruction: str
    demonstration: dict[str, Any]
    first: Observation


class SyntheticEpisodes:
    """Makes the inputs that a policy with these needs receives, with random values.

    The same calls in the same order give the same values: all draw from one generator.

    Args:
        needs: of the policy.
        seed: of all random values.
    """

    def __init__(self, needs: PolicyNeeds, seed: int = 0) -> None:
        self._needs = needs
        self._rng = np.random.default_rng(seed)

    def episode(self, instruction: str, size: int) -> SyntheticEpisode:
        """Return an episode with a video of `size` control steps; 0 for none.

        The video has every n-th picture, as the policy's needs say, but all joints and poses.
        """
        # Without a video its fields are arrays of length 0, whose shapes come of one observation.
        observations = [self._observation(instruction) for _ in range(max(size, 1))]
        video: dict[str, Any] = {}
        for field in observations[0]:
            every = self._frames_between(field)
            if every is not None:
                values = np.stack([observation[field] for observation in observations])
                video[field] = values[:size:every]
        first = self._observation(instruction)
        if self._needs.observe_every is not None:
            first["history"] = ()
        return SyntheticEpisode(instruction, video, cast("Observation", first))

    def _frames_between(self, field: str) -> int | None:
        """Return n if a video has every n-th value of a field; None if it has none."""
        frames = self._needs.demonstration_frames
        if field == "instruction":
            return None
        if not field.endswith(("_rgb", "_depth")) or frames == "all":
            return 1
        return None if frames == "none" else int(frames)

    def after(self, episode: SyntheticEpisode, steps: int) -> Observation:
        """Return an observation `steps` control steps later, with the history in between.

        The last entry of the history is the observation itself if it is due at that step.
        """
        last = self._observation(episode.instruction)
        every = self._needs.observe_every
        if every is not None:
            history = [self._observation(episode.instruction) for _ in range(steps // every)]
            if history and steps % every == 0:
                history[-1] = dict(last)
            last["history"] = tuple(history)
        return cast("Observation", last)

    def _observation(self, instruction: str) -> dict[str, Any]:
        """Return an observation with random values in all fields that the policy needs.

        The history is left to the callers. The order of the draws decides the values.
        """
        rng = self._rng
        observation: dict[str, Any] = {}
        for camera in self._needs.cameras:
            observation[f"{camera}_rgb"] = rng.integers(0, 256, PICTURE, dtype=np.uint8)
        if self._needs.depth:
            for camera in self._needs.cameras:
                observation[f"{camera}_depth"] = rng.integers(0, DEEPEST_MM, DEPTH, dtype=np.int16)
        if self._needs.calibration:
            for camera in self._needs.cameras:
                extrinsic = rng.uniform(-1, 1, (3, 4)).astype(np.float32)
                observation[f"{camera}_extrinsic"] = extrinsic
                observation[f"{camera}_intrinsic"] = INTRINSIC.copy()
        pose = np.append(rng.uniform(REACH_LOW, REACH_HIGH), rng.uniform(-np.pi, np.pi, 3))
        joints = rng.uniform(JOINT_LOW, JOINT_HIGH, ARM_JOINTS).astype(np.float32)
        observation["joint_positions"] = joints
        observation["gripper"] = np.full(2, rng.uniform(0, _FINGER_RANGE), np.float32)
        observation["end_effector"] = pose
        observation["instruction"] = instruction
        return observation
