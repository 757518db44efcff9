"""Shared by all tests: how strictly Hypothesis looks, and helpers that play episodes."""

from collections.abc import Callable

import pytest
from hypothesis import HealthCheck, settings

# Examples are derived from the test, not from the clock: CI finds what a laptop finds.
settings.register_profile(
    "roboirg", deadline=None, derandomize=True, suppress_health_check=[HealthCheck.too_slow]
)
settings.load_profile("roboirg")


@pytest.fixture
def play() -> Callable:
    """Play an environment with a policy to its end; gives the last info."""

    def to_the_end(env, policy):
        if hasattr(policy, "attach"):
            policy.attach(env)
        observation, info = env.reset()
        policy.reset(env.instruction.text, info["demonstration"])
        while info["status"] == "ongoing":
            for action in policy.act(observation):
                observation, _, terminated, truncated, info = env.step(action)
                if terminated or truncated:
                    break
        return info

    return to_the_end
