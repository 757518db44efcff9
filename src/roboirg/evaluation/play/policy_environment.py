"""The environment of a job, with what its policy needs."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

from roboirg.core.actions import ActionSpace
from roboirg.core.errors import InvalidValueError
from roboirg.core.observations import DemonstrationFrames
from roboirg.evaluation.records.record import Job
from roboirg.policies.contract.base import Policy
from roboirg.policies.contract.requirements import (
    wanted_actions,
    wanted_calibration,
    wanted_cameras,
    wanted_demonstration_frames,
    wanted_depth,
    wanted_history,
    wanted_history_cameras,
)

if TYPE_CHECKING:
    from roboirg.envs.environment import RoboIRGEnv


class EnvRequirements(NamedTuple):
    """What a policy needs from its environment.

    Attributes:
        cameras: names of the cameras that it reads.
        actions: its action space.
        demonstration_frames: which frames of the video it gets.
        observe_every: control steps between two observations in ``history``; None for no history.
        history_cameras: cameras recorded in the history; None for all of `cameras`.
        grounded: whether it passes on subgoals with pixels.
        depth: whether it reads depth.
        calibration: whether it reads the cameras' matrices.
    """

    cameras: tuple[str, ...]
    actions: ActionSpace
    demonstration_frames: DemonstrationFrames = "all"
    observe_every: int | None = None
    history_cameras: tuple[str, ...] | None = None
    grounded: bool = False
    depth: bool = False
    calibration: bool = False


def env_requirements(policy: Policy, job: Job) -> EnvRequirements:
    """Return what the policy needs; what the job prescribes takes precedence.

    Raises:
        InvalidValueError: the job prescribes another action space than the policy's.
    """
    actions = wanted_actions(policy)
    if job.actions not in (None, actions.name):
        raise InvalidValueError(
            f"the policy's action space is {actions.name!r}, but the plan requires {job.actions!r}."
        )
    frames, every = job.demonstration_frames, job.observe_every
    return EnvRequirements(
        wanted_cameras(policy),
        actions,
        wanted_demonstration_frames(policy) if frames is None else frames,
        wanted_history(policy) if every is None else every,
        wanted_history_cameras(policy),
        bool(getattr(policy, "grounded", False)),
        wanted_depth(policy),
        wanted_calibration(policy),
    )


def make_env(job: Job, needs: EnvRequirements) -> RoboIRGEnv:
    """Return the environment of a job with what the policy needs."""
    from roboirg.envs.factory import make

    return make(
        job.task,
        split=job.split,
        episode=job.episode,
        **job.options._replace(wordings=job.wordings)._asdict(),
        cameras=needs.cameras,
        depth=needs.depth,
        calibration=needs.calibration,
        actions=needs.actions.name,
        grounded=needs.grounded,
        demonstration_frames=needs.demonstration_frames,
        observe_every=needs.observe_every,
        history_cameras=needs.history_cameras,
        meshes=job.meshes,
        max_steps=job.max_steps,
    )
