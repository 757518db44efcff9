"""Play a single episode in Python, outside of a run."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, cast

from roboirg.core.errors import InvalidValueError
from roboirg.core.observations import Observation
from roboirg.policies.contract.base import Policy, PrivilegedPolicy, tell_policy
from roboirg.policies.contract.policy_needs import ENV_NEEDS, PolicyNeeds

if TYPE_CHECKING:
    from roboirg.envs.environment import RoboIRGEnv


def play(env: RoboIRGEnv, policy: Policy) -> dict[str, Any]:
    """Play the environment's episode from beginning to end with a policy.

    Returns:
        The last step's info; its ``status`` is success, failure or timeout.

    Raises:
        InvalidActionError: the policy gave actions that have a wrong shape or are not finite.
        InvalidValueError: the action space or the observations of the environment are not those
            that the policy needs.
    """
    _check(env, policy)
    observation, info = env.reset()
    if isinstance(policy, PrivilegedPolicy):
        policy.attach(env)
    policy.reset(observation["instruction"], info["demonstration"])
    while info["status"] == "ongoing":
        actions = policy.act(cast("Observation", observation))
        observation, *_, info = env.step_chunk(actions)
        tell_policy(policy, info["heard"])
    return info


def _check(env: RoboIRGEnv, policy: Policy) -> None:
    """Raise if the environment does not meet the policy's needs."""
    needs = PolicyNeeds.of(policy, *ENV_NEEDS)
    if needs.actions != env.actions:
        raise InvalidValueError(
            f"{type(policy).__name__} acts in {needs.actions!r}, but the environment takes "
            f"{env.actions!r}; make it with actions={needs.actions!r}."
        )
    for attribute in ("demonstration_frames", "observe_every", "history_cameras"):
        value, given = getattr(needs, attribute), getattr(env, attribute)
        if hasattr(policy, attribute) and value != given:
            raise InvalidValueError(
                f"{type(policy).__name__} needs {attribute}={value!r}, but the environment has "
                f"{given!r}; make it with {attribute}={value!r}."
            )
    for attribute in ("depth", "calibration"):
        if getattr(needs, attribute) and not getattr(env, attribute):
            raise InvalidValueError(
                f"{type(policy).__name__} needs {attribute}=True, but the environment has none; "
                f"make it with {attribute}=True."
            )
