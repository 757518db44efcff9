"""Playing one episode by hand, without a run around it."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, cast

from roboirg.core.errors import InvalidValueError
from roboirg.core.observations import Observation
from roboirg.policies.base import Policy, PrivilegedPolicy
from roboirg.policies.requirements import (
    wanted_actions,
    wanted_demonstration_frames,
    wanted_history,
    wanted_history_cameras,
)

if TYPE_CHECKING:
    from roboirg.envs.environment import RoboIRGEnv


def play(env: RoboIRGEnv, policy: Policy) -> dict[str, Any]:
    """Let a policy play an environment's episode from its beginning to its end.

    Returns:
        The last step's info; its ``status`` is success, failure or timeout.

    Raises:
        InvalidActionError: the policy gave an action of a wrong shape or not finite.
        InvalidValueError: the environment has another action space than the policy, or shows
            something else than it asks for.
    """
    _check(env, policy)
    observation, info = env.reset()
    if isinstance(policy, PrivilegedPolicy):
        policy.attach(env)
    policy.reset(env.instruction.text, info["demonstration"])
    while info["status"] == "ongoing":
        actions = policy.act(cast("Observation", observation))
        observation, *_, info = env.step_chunk(actions)
    return info


def _check(env: RoboIRGEnv, policy: Policy) -> None:
    """Complain if the environment is not what the policy asks for."""
    wanted = wanted_actions(policy).name
    if wanted != env.actions:
        raise InvalidValueError(
            f"{type(policy).__name__} acts in {wanted!r}, but the environment takes "
            f"{env.actions!r}; make it with actions={wanted!r}."
        )
    wishes: dict[str, object] = {
        "demonstration_frames": wanted_demonstration_frames(policy),
        "observe_every": wanted_history(policy),
        "history_cameras": wanted_history_cameras(policy),
    }
    for attribute, wish in wishes.items():
        given = getattr(env, attribute)
        if hasattr(policy, attribute) and wish != given:
            raise InvalidValueError(
                f"{type(policy).__name__} wants {attribute}={wish!r}, but the environment has "
                f"{given!r}; make it with {attribute}={wish!r}."
            )
