"""Rivals: a second value on equal terms, and words that single one of the two out."""

from __future__ import annotations

import dataclasses
import functools
import itertools
from collections import Counter
from fractions import Fraction

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from language_variants import TASKS, first_episodes

from roboirg.core.errors import InvalidValueError
from roboirg.core.instruction_options import InstructionOptions
from roboirg.core.word_pools import POOLS
from roboirg.language import instruct, instruct_with
from roboirg.language.generator import find_refusal
from roboirg.language.rivals import rival_templates
from roboirg.language.settings import settings_of
from roboirg.reader import interpret
from roboirg.reader.selections import OPEN, read_selection
from roboirg.reader.tokens import split_sentences
from roboirg.shortcuts import SURFACE_RULES, goal_share, guess_goal
from roboirg.shortcuts.command_chance import blind_goals, right_share
from roboirg.tasks import all_tasks, get_task
from roboirg.tasks.splits.splits import get_episode

RIVAL = InstructionOptions("direct-rival")


def told(task, split="test", count=12):
    """Episodes with a rival, each with its instruction."""
    for episode in first_episodes(task, split, count):
        if find_refusal(episode, RIVAL) is None:
            yield episode, instruct_with(episode, RIVAL)


@given(st.sampled_from(TASKS), st.integers(0, 10_000), st.sampled_from(POOLS))
@settings(max_examples=30)
def test_random_episodes_are_read_back(task, index, pool):
    """Exactly one goal with the context, two or more without; resolved, the command alone."""
    episode = get_episode(task, "random", index)
    options = dataclasses.replace(RIVAL, wordings=pool)
    if find_refusal(episode, options) is not None:
        return
    said = instruct_with(episode, options)
    found = interpret(said.text, episode.scene, task)
    assert (found.goals, found.not_understood) == ((episode.goal,), ()), said.text
    alone = interpret(said.command, episode.scene, task).goals
    assert episode.goal in alone
    assert len(alone) > 1
    resolved = instruct_with(episode, dataclasses.replace(options, form="resolved"))
    assert interpret(resolved.command, episode.scene, task).goals == (episode.goal,)
    assert resolved.turns[:-1] == said.turns[:-1]


@pytest.mark.parametrize("task", TASKS)
def test_the_notes_are_those_of_the_words(task):
    for episode, said in told(task):
        notes = said.metadata
        slot = notes["rival_slot"]
        meant = episode.goal[slot]
        meant = meant[0] if isinstance(meant, tuple) else meant
        introduced = [one for one in said.mentions if one.utterance == 0]
        assert [one.role for one in introduced] == ["antecedent"] * 2
        values = [one.value for one in introduced]
        assert notes["candidates"] == {slot: values}
        assert sorted(map(str, values)) == sorted((str(meant), str(notes["rival"])))
        at = ("first", "second").index(notes["rival_position"])
        assert values[at] == notes["rival"]
        goals = get_task(task).goals(episode.scene)
        assert any(
            goal != episode.goal and notes["rival"] in contents(goal, slot) for goal in goals
        )
        choice = read_selection(split_sentences(said.command)[0])
        assert choice == 1 - at, said.text


def contents(goal, slot):
    value = goal[slot]
    return value if isinstance(value, tuple) else (value,)


def test_no_other_setting_has_a_rival():
    for task in TASKS:
        episode = get_episode(task, "test", 3)
        for setting in set(settings_of(get_task(task))) - {"direct-rival", "grounded"}:
            assert instruct(episode, setting).metadata["rival"] is None


def test_what_cannot_have_a_rival_is_refused_by_name():
    episodes = (get_episode("BinFill", "test", index) for index in itertools.count())
    episode = next(one for one in episodes if one.difficulty == "hard")
    reason = "The direct-rival setting cannot express .*counts cubes of several colors"
    with pytest.raises(InvalidValueError, match=reason):
        instruct(episode, "direct-rival")


@functools.cache
def all_told():
    return [one for task in all_tasks() for one in told(task, "train", 60)]


def test_a_block_of_four_has_every_order():
    for task in ("StopCube", "VideoRepick"):
        drawn = [instruct(get_episode(task, "test", index), "direct-rival") for index in range(8)]
        for block in (drawn[:4], drawn[4:]):
            noted = {
                entry
                for said in block
                for entry in said.metadata["templates"]
                if entry.startswith("rival order/")
            }
            assert len(noted) == 4


def test_each_value_is_meant_equally_often():
    """Whatever the episode: in blocks of four, each order comes with each kind of pointer once."""
    found = Counter(said.metadata["rival_position"] for _, said in all_told())
    assert abs(found["first"] / found.total() - 0.5) < 0.01
    kinds = Counter(said.metadata["rival_reference"] for _, said in all_told())
    assert set(kinds) == {"alone", "set aside", *rival_templates.CHOICES}
    assert min(kinds.values()) > 0.08 * kinds.total()


def test_no_rule_is_above_chance():
    episodes = all_told()
    chance = sum(right_share(blind_goals(said, one), one) for one, said in episodes)
    assert chance == Fraction(len(episodes), 2)
    for rule in SURFACE_RULES:
        right = sum(
            goal_share(guess_goal(rule, said.text, one.task), one) for one, said in episodes
        )
        assert right / len(episodes) < 0.55, rule


def test_only_understanding_finds_the_value():
    text = (
        "I like the red cube and the blue cube. {} Take the cube I mean and put it on the target."
    )
    for said, color in (
        ("I mean the former.", "red"),
        ("Not the former.", "blue"),
        ("I mean the former - no, the latter.", "blue"),
        ("I mean the latter, not the other cube.", "blue"),
        ("I mean the other cube, not the latter.", "red"),
        ("I gave up the one I mentioned earlier for the other cube.", "blue"),
        ("I prefer the other cube to the last one I mentioned.", "red"),
        ("I cannot do without the latter.", "blue"),
    ):
        assert read_selection(split_sentences(said)[0]) == ("red", "blue").index(color), said
        scene = get_episode("PickXtimes", "test", 2).scene
        goals = interpret(text.format(said), scene, "PickXtimes").goals
        assert {goal.text("color") for goal in goals} == {color}, said


@pytest.mark.parametrize(
    "said",
    ["I mean the former, not the former.", "I like it.", "I see the other cube.", "The first day."],
)
def test_other_remarks_single_nothing_out(said):
    assert read_selection(split_sentences(said)[0]) in (None, OPEN)
