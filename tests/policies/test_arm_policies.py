"""Built-in policies in the control arms, by the goals that they choose: no world is needed."""

from __future__ import annotations

import functools
from types import SimpleNamespace

import pytest

from roboirg.core.errors import InvalidValueError
from roboirg.core.instruction_options import InstructionOptions
from roboirg.language import expressible
from roboirg.language.arms import say_arm
from roboirg.policies import make_policy
from roboirg.tasks import all_tasks, with_goal
from roboirg.tasks.other_goals import begins_with
from roboirg.tasks.splits.splits import get_episode

SETTING = "direct"
EPISODES = 6
"""Episodes of each task."""


@functools.cache
def scenes():
    """Return the task and number of six test episodes of each task, if *direct* can say them."""
    found = []
    for task in all_tasks():
        for index in range(EPISODES):
            if SETTING in expressible(get_episode(task, "test", index)):
                found.append((task, index))
    return found


@functools.cache
def words_of_control(task, index, arm):
    """Return what an arm says in an episode; None if it cannot say anything."""
    episode = get_episode(task, "test", index)
    try:
        return say_arm(episode, InstructionOptions(SETTING), arm)
    except InvalidValueError:
        return None


def goal_chosen_by(policy, said):
    """Return the goal that a policy takes the words of an arm for; None if it gives up."""
    env = SimpleNamespace(
        episode=said.episode, original=said.original, instruction=said.instruction
    )
    return make_policy(policy, 0).decide(env, said.instruction.text)


def succeeds(policy, scene, arm):
    """Return whether the goal that a policy chooses would succeed; None without the arm."""
    said = words_of_control(*scene, arm)
    if said is None:
        return None
    goal = goal_chosen_by(policy, said)
    return goal is not None and begins_with(
        with_goal(said.episode, goal).stages, said.episode.stages
    )


def share_won_in_all(policy, *arms):
    """Return the share of scenes with all arms in which a policy succeeds in all of them."""
    wins = []
    for scene in scenes():
        successes = {succeeds(policy, scene, arm) for arm in arms}
        if None not in successes:
            wins.append(successes == {True})
    assert len(wins) > EPISODES
    return sum(wins) / len(wins)


@pytest.mark.parametrize(
    ("policy", "share"),
    [("oracle", 1.0), ("listener", 1.0), ("habit", 0.0), ("previous-goal", 0.0)],
)
def test_only_policies_that_listen_succeed_both_at_the_goal_and_at_another_one(policy, share):
    """*Told* commands the true goal, *other-goal* another one of the same scene.

    The policies "habit" and "previous-goal" ignore the words. The oracle needs none.
    """
    assert share_won_in_all(policy, "told", "other-goal") == share


@pytest.mark.parametrize(
    ("policy", "arm"),
    [
        ("previous-goal", "told"),  # the words of another episode
        ("habit", "other-goal"),  # the scene by heart
        ("listener", "silent"),  # needs words
        ("listener", "scrambled"),  # needs their order
        ("forgetful", "paraphrase-1"),  # guesses anew at each text
    ],
)
def test_each_control_run_has_a_policy_with_a_known_fault_that_fails_it(policy, arm):
    """A control ("arm") replaces the command: by another goal, silence, or other words."""
    assert share_won_in_all(policy, arm) < 0.7
    assert share_won_in_all("oracle", arm) == 1.0


def test_a_policy_that_knows_scenes_by_heart_is_exposed_by_another_goal_alone():
    """The policy "habit" does what the scene's own goal asks for, whatever is said."""
    other_arms = ("told", "silent", "scrambled", "paraphrase-1", "paraphrase-2")

    assert share_won_in_all("habit", *other_arms) == 1.0
    assert share_won_in_all("habit", "other-goal") == 0.0


def test_a_policy_that_guesses_succeeds_less_often_with_two_paraphrases_than_with_one():
    """The policy "forgetful" guesses anew for each text, so it has to be lucky twice."""
    first = share_won_in_all("forgetful", "paraphrase-1")
    second = share_won_in_all("forgetful", "paraphrase-2")

    assert share_won_in_all("forgetful", "paraphrase-1", "paraphrase-2") < min(first, second)
