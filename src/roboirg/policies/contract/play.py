"""The loop that plays an episode, and `play`, which plays one outside of a run."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any, cast

from numpy.typing import ArrayLike

from roboirg.core.errors import InvalidValueError
from roboirg.core.observations import Demonstration, Observation
from roboirg.core.policy_needs import ENV_NEEDS, PolicyNeeds
from roboirg.policies.contract.base import Policy, PrivilegedPolicy, tell_policy

if TYPE_CHECKING:
    from roboirg.envs.environment import RoboIRGEnv


Moment = tuple[dict[str, Any], dict[str, Any]]
"""An observation, and the info that comes with it."""


class EpisodeLoop:
    """The turns of an episode; subclasses guard, record or split its calls.

    `play` calls `begin`, then, while the episode goes on, `act`, `execute` and, if something was
    said meanwhile, `hear`.
    """

    def __init__(self, env: RoboIRGEnv, policy: Policy) -> None:
        self.env = env
        self.policy = policy

    def play(self) -> dict[str, Any]:
        """Play the episode from beginning to end. Returns the last step's info."""
        return self.take_turns(*self.begin())

    def begin(self) -> Moment:
        """Start the episode and the policy."""
        observation, info = self.env.reset()
        self.start_policy(observation["instruction"], info["demonstration"])
        return observation, info

    def start_policy(self, instruction: str, demonstration: Demonstration) -> None:
        """Start the policy, which gets the world first if it is privileged."""
        if isinstance(self.policy, PrivilegedPolicy):
            self.policy.attach(self.env)
        self.policy.reset(instruction, demonstration)

    def take_turns(self, observation: dict[str, Any], info: dict[str, Any]) -> dict[str, Any]:
        """Let the policy act until the episode is over. Returns the last step's info."""
        while info["status"] == "ongoing":
            observation, info = self.execute(self.act(observation))
            if info["heard"]:
                self.hear(info["heard"])
        return info

    def act(self, observation: dict[str, Any]) -> ArrayLike:
        """Return the policy's next actions."""
        return self.policy.act(cast("Observation", observation))

    def execute(self, actions: ArrayLike) -> Moment:
        """Execute actions. Returns the observation and the info after them."""
        observation, *_, info = self.env.step_chunk(actions)
        return observation, info

    def hear(self, utterances: Sequence[Mapping[str, Any]]) -> None:
        """Let the policy hear what has just been said."""
        for utterance in utterances:
            tell_policy(self.policy, utterance["text"], utterance["step"])


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
    return EpisodeLoop(env, policy).play()


_CHECKED_NEEDS = (
    "actions",
    "demonstration_frames",
    "observe_every",
    "history_cameras",
    "depth",
    "calibration",
)


def _check(env: RoboIRGEnv, policy: Policy) -> None:
    """Raise if the environment was made with other values than the policy declares as its needs.

    What a policy does not declare, it takes as it comes; only the action space always counts.

    Raises:
        InvalidValueError: the message says how to make the environment.
    """
    needs = PolicyNeeds.of(policy, *ENV_NEEDS)
    for name in _CHECKED_NEEDS:
        needed = getattr(needs, name)
        given = getattr(env, name)
        # What a policy does not declare, it takes as it comes.
        is_declared = name == "actions" or hasattr(policy, name)
        if is_declared and needed and needed != given:
            raise InvalidValueError(
                f"{type(policy).__name__} needs {name}={needed!r}, but the environment has "
                f"{given!r}; make it with {name}={needed!r}."
            )
