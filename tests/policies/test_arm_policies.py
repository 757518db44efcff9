"""Built-in policies in the control arms, by the goals that they choose: no world is needed."""

from __future__ import annotations

import functools
from types import SimpleNamespace

import pytest

from roboirg.analysis.measures.chance import silent_chance
from roboirg.core.episode import Goal
from roboirg.core.errors import InvalidValueError
from roboirg.core.instruction_options import InstructionOptions
from roboirg.language import expressible
from roboirg.language.arms import ArmWords, say_arm
from roboirg.policies import make_policy
from roboirg.stats.intervals import wilson_interval
from roboirg.tasks import all_tasks, with_goal
from roboirg.tasks.other_goals import begins_with
from roboirg.tasks.splits.splits import get_episode

SETTING = "direct"
COUNT = 6
"""Episodes of each task."""
ALL_ARMS = ("told", "other-goal", "silent", "scrambled", "paraphrase-1", "paraphrase-2")
Scene = tuple[str, int]


@functools.cache
def scenes(count: int = COUNT) -> tuple[Scene, ...]:
    return tuple(
        (task, index)
        for task in all_tasks()
        for index in range(count)
        if SETTING in expressible(get_episode(task, "test", index))
    )


@functools.cache
def words(task: str, index: int, arm: str) -> ArmWords | None:
    episode = get_episode(task, "test", index)
    options = InstructionOptions(SETTING)
    try:
        return say_arm(episode, options, arm)
    except InvalidValueError:
        return None


def chosen(policy: str, said: ArmWords, seed: int = 0) -> Goal | None:
    env = SimpleNamespace(
        episode=said.episode, original=said.original, instruction=said.instruction
    )
    decide = make_policy(policy, seed).decide  # type: ignore[attr-defined]
    return decide(env, said.instruction.text)  # type: ignore[no-any-return]


def succeeds(policy: str, scene: Scene, arm: str, seed: int = 0) -> bool | None:
    """Return whether the goal that a policy chooses would succeed; None without the arm."""
    said = words(*scene, arm)
    if said is None:
        return None
    goal = chosen(policy, said, seed)
    stages = () if goal is None else with_goal(said.episode, goal).stages
    return goal is not None and begins_with(stages, said.episode.stages)


def rate(policy: str, *arms: str) -> float:
    """Return the share of scenes with all arms in which a policy succeeds in all of them."""
    wins = []
    for scene in scenes():
        successes = {succeeds(policy, scene, arm) for arm in arms}
        if None not in successes:
            wins.append(successes == {True})
    assert len(wins) > COUNT
    return sum(wins) / len(wins)


def test_language_use_of_who_listens_and_who_does_not():
    assert rate("oracle", "told", "other-goal") == 1.0
    assert rate("listener", "told", "other-goal") == 1.0
    for policy in ("habit", "previous-goal"):
        assert rate(policy, "told", "other-goal") == 0.0
    assert rate("oracle", "silent") == 1.0


def test_in_silence_who_listens_is_at_chance():
    won = [succeeds("listener", scene, "silent") for scene in scenes(15)]
    low, high = wilson_interval(sum(map(bool, won)), len(won))

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
def test_each_arm_has_a_policy_that_fails_it(policy, arm):
    assert rate(policy, arm) < 0.7
    assert rate("oracle", arm) == 1.0


def test_the_planted_cheats_are_found_by_the_arms_alone():
    # Told, habit is as good as the oracle; nothing but another goal tells them apart.
    assert rate("habit", *(arm for arm in ALL_ARMS if arm != "other-goal")) == 1.0
    # All paraphrases at once are harder than one for who guesses.
    both = rate("forgetful", "paraphrase-1", "paraphrase-2")
    assert both < min(rate("forgetful", f"paraphrase-{number}") for number in (1, 2))
