"""The shortcut listeners as policies."""

from types import SimpleNamespace

import pytest

import roboirg
from roboirg.policies import make_policy, play
from roboirg.policies.builtin import BUILTIN, listeners
from roboirg.policies.by_name.finding import find_policy, read_policy
from roboirg.shortcuts.surface_rules import SURFACE_RULES
from roboirg.tasks.splits.splits import get_episode

SPATIAL = "Have a look at the cube at the far left. Take it and place it on the target once."


def test_every_rule_that_guesses_from_words_is_also_a_policy():
    assert set(SURFACE_RULES) <= set(BUILTIN)
    for rule in SURFACE_RULES:
        policy = make_policy(rule, 3)
        assert isinstance(policy, listeners.ShortcutPolicy)
        assert (policy.rule, policy.seed, policy.cameras) == (rule, 3, ())
        assert read_policy(rule).is_privileged
        assert find_policy(rule).version == "built-in"


def test_a_value_that_the_words_leave_open_is_drawn_by_the_policy_s_seed():
    """The sentence leaves the color open and says once; 60 seeds draw all three colors."""
    env = SimpleNamespace(episode=get_episode("PickXtimes", "test", 2))  # has all three colors
    goals = [make_policy("surface", seed).decide(env, SPATIAL) for seed in range(60)]

    assert {goal["color"] for goal in goals} == {"red", "green", "blue"}
    assert {goal["repeats"] for goal in goals} == {1}
    assert goals == [make_policy("surface", seed).decide(env, SPATIAL) for seed in range(60)]


def status(rule, setting):
    env = roboirg.make("PickXtimes", setting=setting, episode=6, cameras=(), max_steps=600)
    return play(env, make_policy(rule, 0))["status"]


@pytest.mark.sim
def test_the_policy_that_takes_the_first_value_named_fails_where_reasoning_is_needed():
    """The green cube, once: in reasoning the words name another number."""
    assert status("first-mention", "direct") == "success"
    assert status("first-mention", "reasoning") == "failure"
