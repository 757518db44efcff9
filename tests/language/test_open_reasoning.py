"""Open reasoning: goals that follow from the words and the scene, and from no single word."""

from __future__ import annotations

import dataclasses
import itertools
from collections import Counter, defaultdict

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from language_variants import TASKS, first_episodes
from test_rivals import pools

from roboirg.core.errors import InvalidValueError
from roboirg.core.instruction_options import InstructionOptions
from roboirg.core.word_pools import POOLS
from roboirg.language import instruct, instruct_with
from roboirg.language.generator import find_refusal
from roboirg.language.open_reasoning import open_templates
from roboirg.language.open_reasoning.open_numbers import COMBINED, balanced_ways
from roboirg.reader import interpret
from roboirg.reader.calculations import read_calculation
from roboirg.reader.comparisons import PlaceComparison, compared_colors, read_comparison
from roboirg.reader.tokens import split_sentences
from roboirg.shortcuts import SURFACE_RULES, goal_share, guess_goal
from roboirg.shortcuts.command_chance import blind_goals, right_share
from roboirg.tasks import all_tasks
from roboirg.tasks.splits.splits import get_episode

OPEN = InstructionOptions("reasoning-open")


def told(task, split="test", count=40):
    for episode in first_episodes(task, split, count):
        if find_refusal(episode, OPEN) is None:
            yield episode, instruct_with(episode, OPEN)


@given(
    st.sampled_from([task for task in TASKS if task != "PutInBox"]),
    st.integers(0, 10_000),
    st.sampled_from(POOLS),
)
@settings(max_examples=150, deadline=None)
def test_random_episodes_are_read_back(task, index, pool):
    episode = get_episode(task, "random", index)
    options = dataclasses.replace(OPEN, wordings=pool)
    if find_refusal(episode, options) is not None:
        return
    said = instruct_with(episode, options)
    found = interpret(said.text, episode.scene, task)
    assert (found.goals, found.not_understood) == ((episode.goal,), ()), said.text
    alone = interpret(said.command, episode.scene, task).goals
    assert episode.goal in alone
    assert len(alone) > 1, said.command
    resolved = instruct_with(episode, dataclasses.replace(options, form="resolved"))
    assert interpret(resolved.command, episode.scene, task).goals == (episode.goal,)


def test_what_no_open_pattern_derives_is_refused_by_name():
    reason = "one number of cubes or one color, and the goal has several"
    with pytest.raises(
        InvalidValueError, match=f"The reasoning-open setting cannot express .*{reason}"
    ):
        instruct(get_episode("BinFill", "test", 3), "reasoning-open")
    with pytest.raises(InvalidValueError, match="PutInBox has no reasoning-open setting"):
        instruct(get_episode("PutInBox", "test", 0), "reasoning-open")


def test_every_pattern_and_step_occurs():
    patterns, notes, relations_ = set(), set(), set()
    for task in all_tasks():
        for _, said in told(task):
            patterns.add(said.metadata["pattern"])
            if said.metadata["pattern"] == "number deduction":
                name, step = said.metadata["relation"].split(", ")
                notes.add(step)
                relations_.add(name)
    assert patterns == {
        "color exclusion", "number deduction", "sequential relation", "contextual logic",
    }  # fmt: skip
    assert notes == set(COMBINED)
    assert relations_ >= {"itself", "one less", "two less", "half"}


CHOICES = [(1, 2), (1, 2, 3), (1, 2, 3, 4), (1, 2, 3, 4, 5), (2, 3, 4, 5)]


@pytest.mark.parametrize("choices", CHOICES)
def test_every_way_leads_from_its_numbers_to_the_result(choices):
    drawn, tickets = balanced_ways(choices)
    assert set(drawn) == set(tickets)
    for numbers, by_result in tickets.items():
        assert set(by_result) == set(choices)
        for result, ways in by_result.items():
            combined = {way.second.result(COMBINED[way.combination](*numbers)) for way in ways}
            assert combined == {result}


@pytest.mark.parametrize("choices", CHOICES)
def test_neither_numbers_nor_calculation_say_anything_about_the_result(choices):
    drawn, tickets = balanced_ways(choices)
    shares = defaultdict(Counter)
    for numbers, count in Counter(drawn).items():
        assert count < 0.07 * len(drawn), "some numbers come up all the time"
        for result, ways in tickets[numbers].items():
            for way in ways:
                shares[way][result] += count / len(drawn) / len(choices) / len(ways)
    known = sum(max(by_result.values()) for by_result in shares.values())
    assert known < 1 / len(choices) + 0.05


def test_no_single_cue_tells_the_moment():
    """Which moment comes first, the one liked better, *not*, and the verbs: each half the time."""
    texts = [
        (f" {said.text.lower()} ", episode.goal.text("relation") == "before")
        for index in range(800)
        if find_refusal(episode := get_episode("VideoPlaceButton", "random", index), OPEN) is None
        for said in [instruct_with(episode, OPEN)]
        if said.metadata["pattern"] == "contextual logic"
    ]
    majority = max(sum(before for _, before in texts), sum(not before for _, before in texts))
    for cue in ("moment right before", " for the one", " not ", "worse", "drop", "keep", "trade"):
        right = sum((cue in text) == before for text, before in texts)
        best = max(right, len(texts) - right)
        assert best < max(majority, len(texts) / 2) + 0.06 * len(texts), cue


def test_which_moment_is_named_last_is_drawn():
    last = [said.mentions[1].value == episode.goal.text("relation")
            for episode, said in told("VideoPlaceButton", "train", 100)
            if said.metadata["pattern"] == "contextual logic"]  # fmt: skip
    favorite = [said.metadata["relation"] for _, said in told("VideoPlaceButton", "train", 100)
                if said.metadata["pattern"] == "contextual logic"]  # fmt: skip
    assert 0.35 < sum(last) / len(last) < 0.65
    assert 0.35 < favorite.count("favorite") / len(favorite) < 0.65


def test_one_must_look_where_a_color_is_excluded():
    """Two colors are left when the words are heard; which one is meant the scene alone tells."""
    for task in ("PickXtimes", "VideoUnmask", "BinFill"):
        for episode, said in told(task):
            if said.metadata["pattern"] != "color exclusion":
                continue
            (excluded,) = {one.value for one in said.mentions if one.utterance == 0}
            left = {"red", "green", "blue"} - {excluded}
            colors = {item.color for item in episode.scene.objects if item.color is not None}
            goal = episode.goal.as_mapping()
            named = goal.get("colors") or (goal["color"],)
            assert set(named) <= left
            assert len(colors) in (2, 3)


def test_comparisons_by_hand():
    scene = get_episode("PickXtimes", "test", 2).scene
    cubes = {item.color: item.position for item in scene.of_kind("cube")}
    nearest = sorted(cubes, key=lambda color: cubes[color].x)
    left = sorted(cubes, key=lambda color: -cubes[color].y)
    assert read_comparison("that is nearer to you") == PlaceComparison(0, -1)
    assert read_comparison("further from you") == PlaceComparison(0, 1)
    assert read_comparison("farther to your left") == PlaceComparison(1, 1)
    assert read_comparison("the far left") is None
    assert compared_colors(PlaceComparison(0, -1), scene, {nearest[0]}) == {nearest[1]}
    assert compared_colors(PlaceComparison(1, 1), scene, {left[-1]}) == {left[0]}
    assert len(compared_colors(PlaceComparison(1, 1), scene, ())) == 2


def test_no_rule_is_above_chance():
    episodes = [one for task in all_tasks() for one in told(task, "train", 100)]
    chance = sum(right_share(blind_goals(said, one), one) for one, said in episodes)
    assert 0.3 < chance / len(episodes) < 0.5
    for rule in SURFACE_RULES:
        right = sum(
            goal_share(guess_goal(rule, said.text, one.task), one) for one, said in episodes
        )
        assert right < chance + 0.05 * len(episodes), rule


def test_the_pools_are_disjoint():
    for name, pool in pools(open_templates):
        assert not set(map(str, pool.train)) & set(map(str, pool.test)), name
        least = 1 if name == "THAT_MANY" else 4
        assert len(pool.train) >= least, name
        assert len(pool.test) >= least, name
    for pool in POOLS:
        for one in open_templates.SECOND_STEPS:
            assert "{first}" in one.words.of(pool)[0]


def test_a_total_of_introduced_numbers_is_read():
    scene = get_episode("PickXtimes", "test", 2).scene
    for words, repeats in (
        ("one time fewer than the total", 4),
        ("half as many times as their difference", None),
        ("twice as many times as the gap between them", 2),
        ("one more time than the difference between two and three", 2),
    ):
        text = f"The dice show three and two. Take the red cube and put it on the target {words}."
        goals = interpret(text, scene, "PickXtimes").goals
        assert [goal.number("repeats") for goal in goals] == ([repeats] if repeats else []), words


@pytest.mark.parametrize(
    ("words", "result"),
    [
        ("Add them up and subtract one.", 4),
        ("Take the difference between those numbers.", 1),
        ("Subtract the smaller from the larger.", 1),
        ("Now take the larger of the numbers and take away two.", 1),
        ("My number is one less than the gap between seven and three.", 3),
        ("I am thinking of half of the higher of four and one.", 2),
        ("It is double the lower of these.", 4),
    ],
)
def test_a_calculation_is_read(words, result):
    scene = get_episode("PickXtimes", "test", 2).scene
    text = f"I rolled two and three. {words} Put the red cube on the target that many times."
    goals = interpret(text, scene, "PickXtimes").goals
    assert [goal.number("repeats") for goal in goals] == [result]


@pytest.mark.parametrize("words", ["Take the larger cube.", "Add it up.", "I like the difference."])
def test_other_sentences_calculate_nothing(words):
    assert read_calculation(split_sentences(words)[0]) is None


def test_a_block_of_four_has_every_combination():
    for task in ("StopCube", "VideoRepick"):
        drawn = [instruct(get_episode(task, "test", index), "direct-rival") for index in range(8)]
        for block in (drawn[:4], drawn[4:]):
            noted = {
                entry
                for said in block
                for entry in said.metadata["templates"]
                if entry.startswith("rival order/")
            }
            assert len(noted) == len(list(itertools.product((0, 1), repeat=2)))
