"""The setting *reasoning*: a value of the goal has to be derived from what was said.

There are four patterns: color exclusion (*I already have the red one and the green one*), number
deduction (*one more than she did*), sequential relation (*the target after that one*), and
contextual logic (*the other one*).
"""

from collections import Counter

import pytest

from roboirg.core.instruction_options import InstructionOptions
from roboirg.language import instruct
from roboirg.language.generator import request_of
from roboirg.language.scenarios.choice import in_turn
from roboirg.language.scenarios.derived import deductions, derivations_of, excluded_colors
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
    """Return what is asked of the setting *reasoning* in an episode."""
    return request_of(get_episode(task, split, index), InstructionOptions("reasoning"))


@pytest.mark.parametrize("task", every_task())
def test_the_test_split_of_a_task_has_each_pattern_of_reasoning_that_fits_it(task):
    """For example, a StopCube goal is a number of visits, and has no color to exclude."""
    found = set()
    for index in range(50):
        said = instruct(get_episode(task, "test", index), "reasoning")
        found.add(said.metadata["pattern"])
    assert found == PATTERNS_OF[task]


@pytest.mark.parametrize("size", [2, 3, 4])
@pytest.mark.parametrize("first", range(4))
def test_patterns_are_equally_frequent_in_every_difficulty(size, first):
    """Episodes choose the patterns of a task in turn, also those of one difficulty alone.

    Difficulties repeat every four episodes; `first` is where such a series of 12 begins.
    """
    patterns = ["exclusion", "deduction", "relation", "logic"][:size]
    episodes = [get_episode("PickXtimes", "test", index) for index in range(first, 48, 4)]

    found = Counter(in_turn(episode, patterns) for episode in episodes)

    assert found == dict.fromkeys(patterns, 12 // size)


@pytest.mark.parametrize("task", ["BinFill", "PickXtimes"])
def test_exclusion_names_every_color_of_the_scene_but_the_goal_s(task):
    """In a scene with one color, it excludes one color that is not there."""
    for index in range(50):
        request = reasoning_request(task, index)
        in_scene = {cube.color for cube in request.episode.scene.of_kind("cube")}
        excluded = set(excluded_colors(request))
        assert in_scene - excluded == {request.color_values[0].value}, request.episode.key
        assert len(excluded) == max(1, len(in_scene) - 1), request.episode.key


def test_a_goal_of_two_colors_never_follows_by_excluding_colors():
    """What is left after excluding colors is one color."""
    for index in range(60):
        request = reasoning_request("VideoUnmask", index, "random")
        if len(request.color_values) > 1:
            for derivation in derivations_of(request):
                assert derivation.notes["pattern"] == OTHER_ONE, request.episode.key


@pytest.mark.parametrize(
    ("steps", "position", "length", "names"),
    [
        (STEPS, 1, 2, []),
        (STEPS, 3, 3, ["right after"]),
        (STEPS, 1, 4, ["right before", "two before"]),
        (COUNTED_STEPS, 1, 4, ["one earlier", "two earlier"]),
    ],
    ids=["first of two", "third of three", "first of four", "first of four, counted"],
)
def test_a_step_between_positions_is_used_only_if_it_leaves_two_positions_open(
    steps, position, length, names
):
    """*The target right before that one* must not give the position away by itself.

    Of two targets only the first is before another one; of three, only the third is two after one.
    """
    choices = [[number] for number in range(1, length + 1)]
    found = deductions([position], choices, steps, length)
    assert [step.name for step, _ in found] == names


def test_a_relation_between_numbers_is_used_only_if_it_leaves_two_numbers_open():
    """If the number is one, two or three, *two more than he has* can only be three."""
    found = deductions([3], [(1,), (2,), (3,)])
    assert [relation.name for relation, _ in found] == [
        "one fewer",
        "one more",
        "two fewer",
        "half",
    ]


def test_a_relation_of_two_numbers_at_once_has_two_numbers_to_count_from():
    """The goal is one and three: *one fewer than two and four*, *half of two and six*.

    The second argument has all amounts that are possible in the scene. *Twice* would need a half.
    """
    found = deductions([1, 3], [(1, 3), (2, 2), (1, 1), (3, 1)])

    assert [(relation.name, references) for relation, references in found] == [
        ("one fewer", [2, 4]),
        ("two fewer", [3, 5]),
        ("half", [2, 6]),
    ]


@pytest.mark.parametrize("task", ["PickXtimes", "BinFill", "StopCube"])
def test_a_relation_never_contains_the_number_that_it_leads_to(task):
    """*One more than that* is not said if the answer is one."""
    spelled = {"one": 1, "two": 2}
    for index in range(50):
        request = reasoning_request(task, index)
        answers = [value.value for value in request.goal_values]
        for derivation in derivations_of(request):
            first_word = str(derivation.notes["relation"]).split()[0]
            assert spelled.get(first_word) not in answers, request.episode.key
