"""Rivals: a second value on equal terms, and words that single one of the two out."""

import functools
import itertools
from collections import Counter

import pytest
from language_variants import TASKS, first_episodes

from roboirg.core.errors import InvalidValueError
from roboirg.core.instruction_options import InstructionOptions
from roboirg.language import instruct, instruct_with
from roboirg.language.generator import find_refusal
from roboirg.language.instruction_row import row
from roboirg.language.settings import settings_of
from roboirg.shortcuts import SURFACE_RULES, goal_share, guess_goal
from roboirg.shortcuts.command_chance import blind_goals, right_share
from roboirg.tasks import all_tasks, get_task
from roboirg.tasks.splits.splits import get_episode

RIVAL_SETTING = InstructionOptions("direct-rival")


def instructions_with_a_rival(task, split="test", count=12):
    """Episodes with a rival, each with its instruction."""
    for episode in first_episodes(task, split, count):
        if find_refusal(episode, RIVAL_SETTING) is None:
            yield episode, instruct_with(episode, RIVAL_SETTING)


@pytest.mark.parametrize("task", TASKS)
def test_the_metadata_about_a_rival_value_agree_with_the_text(task):
    """The introduction names two values, the right one and its rival; the command points at one by
    *the former*, *the latter* or what it is not. Rules that guess are scored by this metadata."""
    for episode, said in instructions_with_a_rival(task):
        notes = said.metadata
        slot = notes["rival_slot"]
        meant = values_of(episode.goal, slot)[0]
        introduced = [mention.value for mention in said.mentions if mention.utterance == 0]
        values = [value for value in introduced if value in (meant, notes["rival"])][:2]
        assert notes["candidates"] == {slot: values}
        assert set(values) == {meant, notes["rival"]}
        at = ("first", "second").index(notes["rival_position"])
        assert values[at] == notes["rival"]
        points_at_former = notes["rival_reference"] in ("former", "not_latter")
        assert points_at_former == (at == 1)
        goals = get_task(task).goals(episode.scene)
        assert any(
            goal != episode.goal and notes["rival"] in values_of(goal, slot) for goal in goals
        )


def test_the_row_of_an_instruction_has_its_rival_and_says_none_without_one():
    episode, said = next(instructions_with_a_rival("PickXtimes"))
    columns = ("rival", "rival_slot", "rival_position", "rival_reference")

    of_rival = row(episode, said)
    of_explicit = row(episode, instruct(episode))

    assert [of_rival[name] for name in columns] == [str(said.metadata[name]) for name in columns]
    assert "none" not in [of_rival[name] for name in columns]
    assert [of_explicit[name] for name in columns] == ["none"] * 4


def values_of(goal, slot):
    value = goal[slot]
    return value if isinstance(value, tuple) else (value,)


def test_only_the_settings_direct_rival_and_grounded_note_a_rival_value():
    """A rival is a second, wrong value that the introduction names like the right one."""
    for task in TASKS:
        episode = get_episode(task, "test", 3)
        for setting in set(settings_of(get_task(task))) - {"direct-rival", "grounded"}:
            assert instruct(episode, setting).metadata["rival"] is None


def test_a_goal_with_several_counts_is_refused_by_the_rival_setting():
    """No second value can be named on equal terms there; hard BinFill goals are of this kind."""
    episodes = (get_episode("BinFill", "test", index) for index in itertools.count())
    episode = next(episode for episode in episodes if episode.difficulty == "hard")
    reason = "The direct-rival setting cannot express .*counts cubes of several colors"

    with pytest.raises(InvalidValueError, match=reason):
        instruct(episode, "direct-rival")


@functools.cache
def training_instructions_with_a_rival():
    return [said for task in all_tasks() for said in instructions_with_a_rival(task, "train", 60)]


@pytest.mark.parametrize("task", ["StopCube", "VideoRepick"])
def test_four_episodes_in_a_row_use_the_four_ways_to_point_at_the_right_value(task):
    """The former, the latter, not the former, not the latter."""
    drawn = [instruct(get_episode(task, "test", index), "direct-rival") for index in range(8)]
    for block in (drawn[:4], drawn[4:]):
        assert len({said.metadata["rival_reference"] for said in block}) == 4


def test_the_first_and_the_second_value_are_right_equally_often():
    """Otherwise, who always takes the first value would be better than chance."""
    found = Counter(
        said.metadata["rival_position"] for _, said in training_instructions_with_a_rival()
    )
    assert abs(found["first"] / found.total() - 0.5) < 0.01

    kinds = Counter(
        said.metadata["rival_reference"] for _, said in training_instructions_with_a_rival()
    )
    assert set(kinds) == {"former", "latter", "not_former", "not_latter"}
    assert min(kinds.values()) > 0.2 * kinds.total()


def test_simple_rules_on_the_text_guess_the_right_value_no_better_than_chance():
    """Two values are named in each text, so chance is one half."""
    episodes = training_instructions_with_a_rival()
    chance = sum(right_share(blind_goals(said, episode), episode) for episode, said in episodes)

    assert 0.49 < chance / len(episodes) <= 0.5  # two values are named
    for rule in SURFACE_RULES:
        right = sum(
            goal_share(guess_goal(rule, said.text, episode.task), episode)
            for episode, said in episodes
        )
        assert right / len(episodes) < 0.55, rule
