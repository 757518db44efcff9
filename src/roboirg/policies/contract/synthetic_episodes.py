"""Synthetic episodes, to check a policy without a simulator."""

from __future__ import annotations

from typing import Any, NamedTuple, cast

import numpy as np

from roboirg.core.actions import ARM_JOINTS, JOINT_HIGH, JOINT_LOW, REACH_HIGH, REACH_LOW
from roboirg.core.observations import Observation
from roboirg.core.policy_needs import PolicyNeeds

PICTURE, DEPTH = (256, 256, 3), (256, 256, 1)
MAX_DEPTH = 2000
"""Millimeters."""
INTRINSIC = np.array([[128, 0, 128], [0, 128, 128], [0, 0, 1]], np.float32)
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
    """Makes the inputs that a policy with these needs receives.

    Args:
        needs: of the policy.
        seed: of all random values.
    """

    def __init__(self, needs: PolicyNeeds, seed: int = 0) -> None:
        self._needs = needs
        self._rng = np.random.default_rng(seed)

    def episode(self, instruction: str, size: int) -> SyntheticEpisode:
        """Return an episode with a video of `size` control steps; 0 for none."""
        observations = [self._observation(instruction) for _ in range(max(size, 1))]
        video: dict[str, Any] = {}
        for field in observations[0]:
            is_picture = field.endswith(("_rgb", "_depth"))
            frames = self._needs.demonstration_frames if is_picture else "all"
            if field != "instruction" and frames != "none":
                every = 1 if frames == "all" else int(frames)
                video[field] = np.stack([one[field] for one in observations])[:size:every]
        first = self._observation(instruction)
        if self._needs.observe_every is not None:
            first["history"] = ()
        return SyntheticEpisode(instruction, video, cast("Observation", first))

    def after(self, episode: SyntheticEpisode, steps: int) -> Observation:
        """Return an observation `steps` control steps later."""
        last = self._observation(episode.instruction)
        if self._needs.observe_every is not None:
            past = [
                self._observation(episode.instruction)
                for _ in range(steps // self._needs.observe_every)
            ]
            if past and steps % self._needs.observe_every == 0:
                past[-1] = dict(last)
            last["history"] = tuple(past)
        return cast("Observation", last)

    def _observation(self, instruction: str) -> dict[str, Any]:
        rng = self._rng
        pictures: dict[str, Any] = {
            f"{camera}_rgb": rng.integers(0, 256, PICTURE, dtype=np.uint8)
            for camera in self._needs.cameras
        }
        for camera in self._needs.cameras if self._needs.depth else ():
            pictures[f"{camera}_depth"] = rng.integers(0, MAX_DEPTH, DEPTH, dtype=np.int16)
        for camera in self._needs.cameras if self._needs.calibration else ():
            pictures[f"{camera}_extrinsic"] = rng.uniform(-1, 1, (3, 4)).astype(np.float32)
            pictures[f"{camera}_intrinsic"] = INTRINSIC.copy()
        pose = np.append(rng.uniform(REACH_LOW, REACH_HIGH), rng.uniform(-np.pi, np.pi, 3))
        return {
            **pictures,
            "joint_positions": rng.uniform(JOINT_LOW, JOINT_HIGH, ARM_JOINTS).astype(np.float32),
            "gripper": np.full(2, rng.uniform(0, _FINGER_RANGE), np.float32),
            "end_effector": pose,
            "instruction": instruction,
        }
