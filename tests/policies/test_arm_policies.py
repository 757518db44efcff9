"""Built-in policies in the control arms, by the goals that they choose: no world is needed."""

from __future__ import annotations

import functools
from types import SimpleNamespace

import pytest

from roboirg.analysis.measures.chance import silent_chance
from roboirg.core.errors import InvalidValueError
from roboirg.core.instruction_options import InstructionOptions
from roboirg.language import expressible
from roboirg.language.arms import say_arm
from roboirg.policies import make_policy
from roboirg.stats.intervals import interval_of_values
from roboirg.tasks import all_tasks, with_goal
from roboirg.tasks.other_goals import begins_with
from roboirg.tasks.splits.splits import get_episode

SETTING = "direct"
EPISODES = 6
"""Episodes of each task."""
ALL_ARMS = ("told", "other-goal", "silent", "scrambled", "paraphrase-1", "paraphrase-2")
Scene = tuple[str, int]


@functools.cache
def scenes(count=EPISODES):
    return tuple(
        (task, index)
        for task in all_tasks()
        for index in range(count)
        if SETTING in expressible(get_episode(task, "test", index))
    )


@functools.cache
def words_of_control(task, index, arm):
    episode = get_episode(task, "test", index)
    options = InstructionOptions(SETTING)
    try:
        return say_arm(episode, options, arm)
    except InvalidValueError:
        return None


def goal_chosen_by(policy, said, seed=0):
    env = SimpleNamespace(
        episode=said.episode, original=said.original, instruction=said.instruction
    )
    decide = make_policy(policy, seed).decide
    return decide(env, said.instruction.text)


def succeeds(policy, scene, arm, seed=0):
    """Return whether the goal that a policy chooses would succeed; None without the arm."""
    said = words_of_control(*scene, arm)
    if said is None:
        return None
    goal = goal_chosen_by(policy, said, seed)
    stages = () if goal is None else with_goal(said.episode, goal).stages
    return goal is not None and begins_with(stages, said.episode.stages)


def share_won_in_all(policy, *arms):
    """Return the share of scenes with all arms in which a policy succeeds in all of them."""
    wins = []
    for scene in scenes():
        successes = {succeeds(policy, scene, arm) for arm in arms}
        if None not in successes:
            wins.append(successes == {True})
    assert len(wins) > EPISODES
    return sum(wins) / len(wins)


def test_only_policies_that_listen_succeed_both_at_the_goal_and_at_another_one():
    """*Told* commands the true goal, *other-goal* another one of the same scene.

    The policies "habit" and "previous-goal" ignore the words. The oracle needs none.
    """
    assert share_won_in_all("oracle", "told", "other-goal") == 1.0
    assert share_won_in_all("listener", "told", "other-goal") == 1.0
    for policy in ("habit", "previous-goal"):
        assert share_won_in_all(policy, "told", "other-goal") == 0.0
    assert share_won_in_all("oracle", "silent") == 1.0


def test_without_a_command_a_listening_policy_succeeds_as_often_as_by_chance():
    """Chance is computed per scene; it has to lie in the interval of the measured rate."""
    won = [succeeds("listener", scene, "silent") for scene in scenes(15)]
    low, high = interval_of_values([list(map(bool, won))])

    chance = sum(silent_chance(task, "test", index) for task, index in scenes(15)) / len(won)

    assert low <= chance <= high


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


def test_policies_with_a_planted_fault_are_exposed_by_control_runs_only():
    """ "habit" knows each scene's goal by heart, "forgetful" guesses anew for each text."""
    # Told, habit is as good as the oracle; nothing but another goal tells them apart.
    assert share_won_in_all("habit", *(arm for arm in ALL_ARMS if arm != "other-goal")) == 1.0
    # All paraphrases at once are harder than one for who guesses.
    # (It has to guess right twice.)
    both = share_won_in_all("forgetful", "paraphrase-1", "paraphrase-2")
    assert both < min(share_won_in_all("forgetful", f"paraphrase-{number}") for number in (1, 2))
