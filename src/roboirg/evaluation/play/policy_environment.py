"""The environment of a job, with what its policy needs."""

from __future__ import annotations

from dataclasses import asdict, replace
from typing import TYPE_CHECKING

from roboirg.core.errors import InvalidValueError
from roboirg.envs.factory import make
from roboirg.evaluation.play.job_instruction import PreparedJob
from roboirg.evaluation.records.record import Job
from roboirg.policies.contract.base import Policy
from roboirg.policies.contract.policy_needs import PolicyNeeds

if TYPE_CHECKING:
    from roboirg.envs.environment import RoboIRGEnv


def job_needs(policy: Policy, job: Job) -> PolicyNeeds:
    """Return what the policy needs; what the job prescribes takes precedence.

    Raises:
        InvalidValueError: an attribute of the policy has an invalid value, or the job prescribes
            another action space than the policy's.
    """
    needs = PolicyNeeds.of(policy)
    if job.actions not in (None, needs.actions):
        raise InvalidValueError(
            f"the policy's action space is {needs.actions!r}, but the plan requires "
            f"{job.actions!r}."
        )
    if job.demonstration_frames is not None:
        needs = replace(needs, demonstration_frames=job.demonstration_frames)
    if job.observe_every is not None:
        needs = replace(needs, observe_every=job.observe_every)
    return needs


def make_env(prepared: PreparedJob, needs: PolicyNeeds) -> RoboIRGEnv:
    """Return the environment of a job with what the policy needs.

    Args:
        prepared: the job with its episode.
        needs: of the policy.
    """
    job = prepared.job
    options = {
        **asdict(job.options),
        **needs.env_options,
        "arm": job.arm,
        "meshes": job.meshes,
        "max_steps": job.max_steps,
    }
    return make(prepared.scene_episode, **options)
