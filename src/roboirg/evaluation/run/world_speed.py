"""How long this machine's world takes for a control step, measured in moments."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import msgspec
import numpy as np
from numpy.typing import NDArray

from roboirg.core.errors import RoboIRGError
from roboirg.core.observations import CAMERAS, Demonstration, Observation
from roboirg.evaluation.episode_errors import EpisodeError
from roboirg.evaluation.play.call_guard import CallGuard
from roboirg.evaluation.play.rollout import play_with
from roboirg.evaluation.play.rollout_result import RolloutResult
from roboirg.evaluation.records.record import Job
from roboirg.policies.contract.policy_needs import PolicyNeeds
from roboirg.tasks.splits.splits import get_episode

MEASURED_STEPS = 64
CHUNK = 16
"""Actions between two observations with both pictures."""


class WorldSpeed(NamedTuple):
    """Seconds of this machine's world, in one process.

    Attributes:
        step_s: for a control step.
        reset_s: until the policy's turn, by whether a video is shown before.
        is_measured: whether it was measured just now.
    """

    step_s: float
    reset_s: Mapping[bool, float]
    is_measured: bool = True

    def seconds(self, job: Job, steps: int) -> float:
        """Return the seconds of an episode in which the policy acts for `steps` steps."""
        return self.reset_s[has_video(job)] + self.step_s * min(steps, job.max_steps)


ASSUMED = WorldSpeed(0.01, {False: 0.1, True: 4.0}, is_measured=False)
"""Two slow cores without a GPU (docs/performance.md)."""


LEAN, SWING = 0.25, 0.3
"""Radians of the shoulder: forward, over the table, and to both sides."""


class SwingingPolicy:
    """Swings its arm over the table and looks at both pictures after every chunk.

    Both are drawn again whenever they are looked at, as for a policy that works; of an arm at rest
    they are not.
    """

    def __init__(self) -> None:
        self._step = 0

    def reset(self, instruction: str, demonstration: Demonstration) -> None:
        """Do nothing; the arm starts where it is."""

    def act(self, observation: Observation) -> NDArray[np.floating[Any]]:
        """Return actions that swing the arm, shape (CHUNK, 8)."""
        for camera in CAMERAS:  # a picture is drawn when it is read
            np.asarray(observation[f"{camera}_rgb"])  # type: ignore[literal-required]
        if self._step == 0:
            self._start = np.append(observation["joint_positions"], 1.0)
        steps = np.arange(self._step, self._step + CHUNK) / MEASURED_STEPS
        self._step += CHUNK
        rows = np.tile(self._start, (CHUNK, 1))
        rows[:, 0] += SWING * np.sin(2 * np.pi * steps)
        rows[:, 1] += LEAN * np.minimum(1.0, 4 * steps)
        return rows


def has_video(job: Job) -> bool:
    """Return whether a video is shown before the policy's turn."""
    return bool(get_episode(job.task, job.split, job.episode).demonstration)


def measure_world(jobs: Sequence[Job]) -> WorldSpeed:
    """Measure an episode without and one with a video, as far as the jobs have them.

    Returns:
        What is assumed, if this machine cannot play.
    """
    samples = {has_video(job): job for job in reversed(jobs)}
    if not samples:
        return ASSUMED
    resets, steps = dict(ASSUMED.reset_s), []
    first = samples[min(samples)]
    try:
        _timings(first)  # what a process does once: shaders, meshes
        for shown, job in sorted(samples.items()):
            found = _timings(job)
            resets[shown] = found["env_reset"]
            steps.append(found["env_step"] / MEASURED_STEPS)
    except (EpisodeError, RoboIRGError):
        return ASSUMED
    return WorldSpeed(max(steps), resets)


def _timings(job: Job) -> dict[str, float]:
    result = RolloutResult()
    short = msgspec.structs.replace(job, max_steps=MEASURED_STEPS, actions=None)
    play_with(SwingingPolicy(), short, PolicyNeeds(), result, CallGuard(result, None))
    return result.timings
