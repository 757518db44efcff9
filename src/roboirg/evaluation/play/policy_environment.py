"""The environment of a job, with what its policy needs."""

from __future__ import annotations

from dataclasses import asdict, replace
from typing import TYPE_CHECKING

from roboirg.core.errors import InvalidValueError
from roboirg.core.policy_needs import ENV_NEEDS, PolicyNeeds
from roboirg.envs.factory import make
from roboirg.evaluation.play.job_instruction import PreparedJob
from roboirg.evaluation.records.record import Job
from roboirg.policies.contract.base import Policy

if TYPE_CHECKING:
    from roboirg.envs.environment import RoboIRGEnv


def job_needs(policy: Policy, job: Job) -> PolicyNeeds:
    """Return what the policy needs; what the job prescribes takes precedence.

    Raises:
        InvalidValueError: an attribute of the policy has an invalid value, or the job prescribes
            another action space than the policy's.
    """
    needs, prescribed = PolicyNeeds.of(policy), job.environment.prescribed
    actions = prescribed.get("actions", needs.actions)
    if actions != needs.actions:
        raise InvalidValueError(
            f"the policy's action space is {needs.actions!r}, but the plan requires {actions!r}."
        )
    return replace(needs, **{name: prescribed[name] for name in ENV_NEEDS if name in prescribed})


def make_env(prepared: PreparedJob, needs: PolicyNeeds) -> RoboIRGEnv:
    """Return the environment of a job with what the policy needs.

    Args:
        prepared: the job with its episode.
        needs: of the policy.
    """
    job = prepared.job
    options = {
        **asdict(job.options),
        **job.environment.prescribed,
        **needs.env_options,
        "arm": job.arm,
    }
    return make(prepared.scene_episode, **options)
