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

OTHER_ONE = "contextual logic"
PATTERNS_OF = {
    "BinFill": {"color exclusion", "number deduction", OTHER_ONE},
    "PickXtimes": {"color exclusion", "number deduction", OTHER_ONE},
    "SwingXtimes": {"color exclusion", "number deduction", OTHER_ONE},
    "StopCube": {"number deduction", "sequential relation", OTHER_ONE},
    "VideoUnmask": {"color exclusion", OTHER_ONE},
    "ButtonUnmask": {"color exclusion", OTHER_ONE},
    "VideoUnmaskSwap": {"color exclusion", OTHER_ONE},
    "ButtonUnmaskSwap": {"color exclusion", OTHER_ONE},
    "VideoRepick": {"number deduction"},
    "VideoPlaceButton": {"color exclusion", "sequential relation", OTHER_ONE},
    "VideoPlaceOrder": {"color exclusion", "number deduction", "sequential relation", OTHER_ONE},
    "PutInBox": {"color exclusion", OTHER_ONE},
    "PickByCount": {"color exclusion", "number deduction", OTHER_ONE},
}


def reasoning_request(task, index, split="test"):
    return request_of(get_episode(task, split, index), InstructionOptions("reasoning"))


@pytest.mark.parametrize("task", every_task())
def test_the_test_split_of_a_task_has_each_pattern_of_reasoning_that_fits_it(task):
    """A pattern is how a value follows from the words: what was excluded, a sum, or an order."""
    found = {
        instruct(get_episode(task, "test", index), "reasoning").metadata["pattern"]
        for index in range(50)
    }
    assert found == PATTERNS_OF[task]


@pytest.mark.parametrize("size", [2, 3, 4])
@pytest.mark.parametrize("first", range(4))
def test_patterns_are_equally_frequent_in_every_difficulty(size, first):
    """Difficulties repeat every four episodes; `first` is where such a series begins."""
    patterns = [str(number) for number in range(size)]
    episodes = [get_episode("PickXtimes", "test", index) for index in range(first, 48, 4)]

    found = Counter(in_turn(episode, patterns) for episode in episodes)

    counts = [found[name] for name in patterns]
    assert max(counts) - min(counts) <= 1
    assert sum(counts) == len(episodes)


def test_exclusion_names_every_color_of_the_scene_but_the_goal_s():
    """*I already have the red and the blue one*: what is left is the goal's color.

    Scenes of these tasks have one, two or three colors.
    """
    found = set()
    for task, index in itertools.product(("BinFill", "PickXtimes"), range(50)):
        asked = reasoning_request(task, index)
        present = {cube.color for cube in asked.episode.scene.of_kind("cube")}
        excluded = set(excluded_colors(asked))
        assert present - excluded == {asked.color_values[0].value}
        assert len(excluded) == max(1, len(present) - 1)
        found.add(len(present))
    assert found == {1, 2, 3}


def test_a_goal_of_two_colors_never_follows_by_excluding_colors():
    for index in range(60):
        asked = reasoning_request("VideoUnmask", index, "random")
        if len(asked.color_values) > 1:
            patterns = {offer.notes["pattern"] for offer in derivations_of(asked)}
            assert patterns == {OTHER_ONE}


def test_a_step_between_positions_is_used_only_if_it_leaves_two_positions_open():
    """*The target right before that one*: the step must not give the position away by itself.

    `names(known, position, length)`: steps to a position among `length`.
    """

    def names(known, position, length):
        choices = [[number + 1] for number in range(length)]
        return [step.name for step, _ in deductions([position], choices, known, length)]

    assert not names(STEPS, 1, 2)  # of two, the one before another is always the first
    # Only the third of three is two after another one.
    assert names(STEPS, 3, 3) == ["right after"]
    assert names(STEPS, 1, 4) == ["right before", "two before"]
    assert names(COUNTED_STEPS, 1, 4) == ["one earlier", "two earlier"]


def test_a_relation_between_numbers_is_used_only_if_it_leaves_two_numbers_open():
    """*Two more than he has* can only be three if numbers end at three, so it is not used."""
    # Of one to three only three is two more than something.
    names = [relation.name for relation, _ in deductions([3], [(1,), (2,), (3,)])]
    assert names == ["one fewer", "one more", "two fewer", "half"]

    # Two numbers at once: 1 and 3 are one fewer than 2 and 4.
    found = deductions([1, 3], [(1, 3), (2, 2), (1, 1), (3, 1)])
    assert [(relation.name, references) for relation, references in found] == [
        ("one fewer", [2, 4]),
        ("two fewer", [3, 5]),
        ("half", [2, 6]),
    ]


def test_a_relation_never_contains_the_number_that_it_leads_to():
    """*One more than that* is not said if the number one is the answer."""
    for task, index in itertools.product(("PickXtimes", "BinFill", "StopCube"), range(50)):
        asked = reasoning_request(task, index)
        numbers = {value.value for value in asked.goal_values if isinstance(value.value, int)}
        for offer in derivations_of(asked):
            spelled = {"one": 1, "two": 2}.get(str(offer.notes["relation"]).split()[0])
            assert spelled not in numbers
