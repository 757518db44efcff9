"""Made-up episodes, to try a policy without a simulator."""

from __future__ import annotations

from typing import Any, NamedTuple, cast

import numpy as np

from roboirg.core.actions import ARM_JOINTS, JOINT_HIGH, JOINT_LOW, REACH_HIGH, REACH_LOW
from roboirg.core.observations import CAMERAS, DemonstrationFrames, Observation

PICTURE = (256, 256, 3)
_FINGER_RANGE = 0.04
"""Meters."""


class SyntheticEpisode(NamedTuple):
    """What a policy is given in an episode, twice asked.

    Attributes:
        instruction: what is said.
        demonstration: the video, T steps.
        first: the first observation.
        size: control steps in the video.
    """

    instruction: str
    demonstration: dict[str, Any]
    first: Observation
    size: int


class SyntheticEpisodes:
    """Makes up what a policy that asks for this is shown.

    Args:
        cameras: whose pictures.
        demonstration_frames: which pictures of the video.
        observe_every: after how many control steps there is an observation in ``history``.
        seed: of everything that is made up.
    """

    def __init__(
        self,
        cameras: tuple[str, ...] = CAMERAS,
        demonstration_frames: DemonstrationFrames = "all",
        observe_every: int | None = None,
        seed: int = 0,
    ) -> None:
        self._cameras = cameras
        self._frames = demonstration_frames
        self._every = observe_every
        self._rng = np.random.default_rng(seed)

    def episode(self, instruction: str, size: int) -> SyntheticEpisode:
        """An episode with a video of so many control steps, 0 for none."""
        moments = [self._moment(instruction) for _ in range(max(size, 1))]
        video: dict[str, Any] = {}
        for field in moments[0]:
            pictured = field.endswith("_rgb")
            if field != "instruction" and not (pictured and self._frames == "none"):
                every = self._frames if pictured and isinstance(self._frames, int) else 1
                video[field] = np.stack([moment[field] for moment in moments])[:size:every]
        first = self._moment(instruction)
        if self._every is not None:
            first["history"] = ()
        return SyntheticEpisode(instruction, video, cast("Observation", first), size)

    def after(self, episode: SyntheticEpisode, steps: int) -> Observation:
        """An observation that many control steps later."""
        last = self._moment(episode.instruction)
        if self._every is not None:
            count = steps // self._every
            last["history"] = tuple(self._moment(episode.instruction) for _ in range(count))
            if count and steps % self._every == 0:
                now = {field: held for field, held in last.items() if field != "history"}
                last["history"] = (*last["history"][:-1], now)
        return cast("Observation", last)

    def garbage(self, episode: SyntheticEpisode) -> Observation:
        """An observation as from broken sensors: NaN everywhere, pictures of noise."""
        broken = self._moment(episode.instruction)
        for field, held in broken.items():
            if isinstance(held, np.ndarray) and held.dtype.kind == "f":
                broken[field] = np.full_like(held, np.nan)
        if self._every is not None:
            broken["history"] = ()
        return cast("Observation", broken)

    def _moment(self, instruction: str) -> dict[str, Any]:
        rng = self._rng
        pictures = {
            f"{camera}_rgb": rng.integers(0, 256, PICTURE, dtype=np.uint8)
            for camera in self._cameras
        }
        pose = np.append(rng.uniform(REACH_LOW, REACH_HIGH), rng.uniform(-np.pi, np.pi, 3))
        return {
            **pictures,
            "joint_positions": rng.uniform(JOINT_LOW, JOINT_HIGH, ARM_JOINTS).astype(np.float32),
            "gripper": np.full(2, rng.uniform(0, _FINGER_RANGE), np.float32),
            "end_effector": pose,
            "instruction": instruction,
        }
