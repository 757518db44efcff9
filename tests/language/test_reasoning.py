"""Reasoning: which patterns a task has, and derivations that give no value away."""

import itertools
from collections import Counter

import pytest

from roboirg.core.instruction_options import InstructionOptions
from roboirg.language import instruct
from roboirg.language.generator import request_of
from roboirg.language.scenarios.choice import in_turn
from roboirg.language.scenarios.derived import (
    deductions,
    derivations_of,
    excluded_colors,
)
from roboirg.language.scenarios.relations import COUNTED_STEPS, STEPS
from roboirg.tasks import every_task
from roboirg.tasks.splits.splits import get_episode

CHOICE = "contextual logic"
PATTERNS_OF = {
    "BinFill": {"color exclusion", "number deduction", CHOICE},
    "PickXtimes": {"color exclusion", "number deduction", CHOICE},
    "SwingXtimes": {"color exclusion", "number deduction", CHOICE},
    "StopCube": {"number deduction", "sequential relation", CHOICE},
    "VideoUnmask": {"color exclusion", CHOICE},
    "ButtonUnmask": {"color exclusion", CHOICE},
    "VideoUnmaskSwap": {"color exclusion", CHOICE},
    "ButtonUnmaskSwap": {"color exclusion", CHOICE},
    "VideoRepick": {"number deduction"},
    "VideoPlaceButton": {"color exclusion", "sequential relation", CHOICE},
    "VideoPlaceOrder": {"color exclusion", "number deduction", "sequential relation", CHOICE},
    "PutInBox": {"color exclusion", CHOICE},
    "PickByCount": {"color exclusion", "number deduction", CHOICE},
}


def request(task, index, split="test"):
    return request_of(get_episode(task, split, index), InstructionOptions("reasoning"))


@pytest.mark.parametrize("task", every_task())
def test_every_pattern_that_makes_sense_for_a_task_is_in_the_test_split(task):
    found = {
        instruct(get_episode(task, "test", index), "reasoning").metadata["pattern"]
        for index in range(50)
    }
    assert found == PATTERNS_OF[task]


@pytest.mark.parametrize("size", [2, 3, 4])
@pytest.mark.parametrize("first", range(4))
def test_patterns_take_turns_in_every_difficulty(size, first):
    """Difficulties repeat every four episodes."""
    patterns = [str(number) for number in range(size)]
    episodes = [get_episode("PickXtimes", "test", index) for index in range(first, 48, 4)]

    found = Counter(in_turn(episode, patterns) for episode in episodes)

    counts = [found[name] for name in patterns]
    assert max(counts) - min(counts) <= 1
    assert sum(counts) == len(episodes)


def test_as_few_colors_are_excluded_as_leave_one():
    """Scenes of these tasks have one, two or three colors."""
    found = set()
    for task, index in itertools.product(("BinFill", "PickXtimes"), range(50)):
        asked = request(task, index)
        present = {cube.color for cube in asked.episode.scene.of_kind("cube")}
        excluded = set(excluded_colors(asked))
        assert present - excluded == {asked.color_values[0].value}
        assert len(excluded) == max(1, len(present) - 1)
        found.add(len(present))
    assert found == {1, 2, 3}


def test_of_two_colors_that_are_both_wanted_none_is_excluded():
    for index in range(60):
        asked = request("VideoUnmask", index, "random")
        if len(asked.color_values) > 1:
            patterns = {offer.notes["pattern"] for offer in derivations_of(asked)}
            assert patterns == {CHOICE}


def test_a_step_leaves_the_position_open():
    def names(known, position, length):
        choices = [[number + 1] for number in range(length)]
        return [step.name for step, _ in deductions([position], choices, known, length)]

    assert not names(STEPS, 1, 2)  # of two, the one before another is always the first
    # Only the third of three is two after another one.
    assert names(STEPS, 3, 3) == ["right after"]
    assert names(STEPS, 1, 4) == ["right before", "two before"]
    assert names(COUNTED_STEPS, 1, 4) == ["one earlier", "two earlier"]


def test_a_relation_leaves_the_number_open():
    # Of one to three only three is two more than something.
    names = [relation.name for relation, _ in deductions([3], [(1,), (2,), (3,)])]
    assert names == ["one fewer", "one more", "two fewer", "half"]

    found = deductions([1, 3], [(1, 3), (2, 2), (1, 1), (3, 1)])
    assert [(relation.name, references) for relation, references in found] == [
        ("one fewer", [2, 4]),
        ("two fewer", [3, 5]),
        ("half", [2, 6]),
    ]


def test_no_relation_is_said_whose_words_have_the_number():
    for task, index in itertools.product(("PickXtimes", "BinFill", "StopCube"), range(50)):
        asked = request(task, index)
        numbers = {value.value for value in asked.goal_values if isinstance(value.value, int)}
        for offer in derivations_of(asked):
            spelled = {"one": 1, "two": 2}.get(str(offer.notes["relation"]).split()[0])
            assert spelled not in numbers
