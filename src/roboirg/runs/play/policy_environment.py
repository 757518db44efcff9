"""The environment of a job, with what its policy needs."""

from __future__ import annotations

from dataclasses import asdict, replace
from typing import TYPE_CHECKING

from roboirg.core.errors import InvalidValueError
from roboirg.core.policy_needs import ENV_NEEDS, PolicyNeeds
from roboirg.envs.factory import make
from roboirg.policies.contract.base import Policy
from roboirg.records.record import Job
from roboirg.runs.job_instruction import PreparedJob

if TYPE_CHECKING:
    from roboirg.envs.environment import RoboIRGEnv


def job_needs(policy: Policy, job: Job) -> PolicyNeeds:
    """Return what the policy needs of the environment, such as pictures or an action space.

    Values that the job prescribes replace the policy's own, but not its action space.

    Raises:
        InvalidValueError: an attribute of the policy has an invalid value, or the job prescribes
            another action space than the policy's.
    """
    needs = PolicyNeeds.of(policy)
    prescribed = job.environment.prescribed
    actions = prescribed.get("actions", needs.actions)
    if actions != needs.actions:
        raise InvalidValueError(
            f"the policy's action space is {needs.actions!r}, but the plan requires {actions!r}."
        )
    changes = {name: prescribed[name] for name in ENV_NEEDS if name in prescribed}
    return replace(needs, **changes)


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
