"""The setting *direct-rival*: two values are introduced on equal terms, and one of them is meant.

*Leo says four times is enough, and Nora says five times. … Let's do what Leo says.* Here the number
four is meant, and five is its rival.
"""

import functools
import itertools
from collections import Counter

import pytest
from language_variants import TASKS, first_episodes, said_where_possible

from roboirg.core.errors import InvalidValueError
from roboirg.core.instruction_options import InstructionOptions
from roboirg.language import instruct
from roboirg.language.instruction_row import row
from roboirg.language.settings import settings_of
from roboirg.shortcuts.command_chance import blind_goals, right_share
from roboirg.shortcuts.surface_rules import SURFACE_RULES
from roboirg.shortcuts.text_guess import goal_share, guess_goal
from roboirg.tasks import all_tasks, get_task
from roboirg.tasks.splits.splits import get_episode

each_task = pytest.mark.parametrize("task", TASKS)


def instructions_with_a_rival(task, split="test", count=12):
    """Return the first episodes of a split that can have a rival, each with its instruction."""
    episodes = first_episodes(task, split, count)
    return said_where_possible(episodes, InstructionOptions("direct-rival"))


def test_the_row_of_an_instruction_has_its_rival_and_says_none_without_one():
    """*Nora says once is enough, and my aunt says three times. Nora isn't in charge …*: three is
    right, and one is its rival, the first of the two, which the command excludes. The row for
    export has this in four columns; that of the explicit instruction, without a rival, "none"."""
    episode = get_episode("PickXtimes", "test", 0)
    columns = ("rival", "rival_slot", "rival_position", "rival_reference")

    of_rival = row(episode, instruct(episode, "direct-rival"))
    of_explicit = row(episode, instruct(episode))

    assert [of_rival[name] for name in columns] == ["1", "repeats", "first", "not_former"]
    assert [of_explicit[name] for name in columns] == ["none"] * 4


def values_of(goal, slot):
    """Return the values of a slot of a goal: ``("red", "blue")`` for two colors."""
    value = goal[slot]
    return value if isinstance(value, tuple) else (value,)


@each_task
def test_the_metadata_about_a_rival_value_agree_with_the_text(task):
    """The first utterance introduces two values of a slot of the goal, such as four and five
    times. The metadata "candidates" has the two in the order of the text, ``{"repeats": [4, 5]}``,
    by which rules that guess are scored."""
    for _, said in instructions_with_a_rival(task):
        candidates = said.metadata["candidates"][said.metadata["rival_slot"]]
        first_utterance = [mention for mention in said.mentions if mention.utterance == 0]
        values = [mention.value for mention in first_utterance if mention.value in candidates]

        assert values[:2] == candidates, said.text


@each_task
def test_the_candidates_are_the_right_value_and_its_rival_at_its_position(task):
    """*Four or five times*, of which four is right: its rival is five, the position of the rival
    "second". The metadata "candidates" have the two values in order, ``{"repeats": [4, 5]}``."""
    for episode, said in instructions_with_a_rival(task):
        slot = said.metadata["rival_slot"]
        right_value = values_of(episode.goal, slot)[0]
        candidates = [right_value, said.metadata["rival"]]
        if said.metadata["rival_position"] == "first":
            candidates.reverse()

        assert said.metadata["candidates"] == {slot: candidates}, said.text


@each_task
def test_the_command_points_at_the_value_that_is_not_the_rival(task):
    """Two values are introduced, of which one, the rival, is not meant. *The former* and *not the
    latter* point at the first value, so that the rival is the second; the others the other way
    round."""
    position_of = {
        "former": "second", "not_latter": "second", "latter": "first", "not_former": "first"
    }  # fmt: skip
    for _, said in instructions_with_a_rival(task):
        position = position_of[said.metadata["rival_reference"]]
        assert said.metadata["rival_position"] == position, said.text


@each_task
def test_a_rival_value_is_that_of_another_goal_of_the_scene(task):
    """The rival is the second value that is introduced and not meant. It must be the value of
    another goal that the scene allows: otherwise who sees the scene need not understand which value
    is meant."""
    for episode, said in instructions_with_a_rival(task):
        others = [goal for goal in get_task(task).goals(episode.scene) if goal != episode.goal]
        slot = said.metadata["rival_slot"]
        assert any(said.metadata["rival"] in values_of(goal, slot) for goal in others), said.text


def test_only_the_settings_direct_rival_and_grounded_note_a_rival_value():
    """A rival is a second value that is introduced on equal terms. All other settings introduce one
    value, or none, so their metadata have no rival."""
    for task in TASKS:
        episode = get_episode(task, "test", 3)
        for setting in set(settings_of(get_task(task))) - {"direct-rival", "grounded"}:
            assert instruct(episode, setting).metadata["rival"] is None, (task, setting)


def test_a_goal_with_several_counts_is_refused_by_the_rival_setting():
    """*Three red cubes and one green cube*: no second value can be named on equal terms."""
    episode = get_episode("BinFill", "test", 3)
    reason = "The direct-rival setting cannot express .*counts cubes of several colors"

    with pytest.raises(InvalidValueError, match=reason):
        instruct(episode, "direct-rival")


@pytest.mark.parametrize("first", [0, 4])
@pytest.mark.parametrize("task", ["StopCube", "VideoRepick"])
def test_four_episodes_in_a_row_use_the_four_ways_to_point_at_the_right_value(task, first):
    """*The former*, *the latter*, *not the former* and *not the latter* point at one of two values.
    Four episodes in a row must use each once, so that each is equally frequent."""
    used = []
    for index in range(first, first + 4):
        said = instruct(get_episode(task, "test", index), "direct-rival")
        used.append(said.metadata["rival_reference"])

    assert sorted(used) == ["former", "latter", "not_former", "not_latter"]


@functools.cache
def training_instructions():
    """Return (episode, instruction) of all tasks, from 60 training episodes of each."""
    by_task = [instructions_with_a_rival(task, "train", 60) for task in all_tasks()]
    return list(itertools.chain.from_iterable(by_task))


def test_the_first_and_the_second_value_are_right_equally_often():
    """`training_instructions` has 60 training episodes of each task. The rival, which is not meant,
    must be the first of the two values in half of them, to 1 %: otherwise, who always takes the
    first value would be better than chance."""
    found = Counter(said.metadata["rival_position"] for _, said in training_instructions())
    assert abs(found["first"] / found.total() - 0.5) < 0.01


def test_each_way_to_point_at_the_right_value_is_used_in_a_fifth_of_training_or_more():
    """`training_instructions` has 60 training episodes of each task. There are four ways to point,
    so a quarter each would be even."""
    found = Counter(said.metadata["rival_reference"] for _, said in training_instructions())

    assert found.keys() == {"former", "latter", "not_former", "not_latter"}
    assert min(found.values()) > 0.2 * found.total()


def test_who_guesses_between_the_two_values_is_right_in_half_of_the_cases():
    """`training_instructions` has 60 training episodes of each task. `blind_goals` returns the
    goals that a text leaves open to one who cannot tell which of the two values is meant; guessing
    among these is right in half of the cases. A few texts leave more than two, so it may be a
    little less."""
    shares = [
        right_share(blind_goals(said, drawn), drawn) for drawn, said in training_instructions()
    ]
    assert 0.49 < sum(shares) / len(shares) <= 0.5


@pytest.mark.parametrize("rule", SURFACE_RULES)
def test_simple_rules_on_the_text_guess_the_right_value_no_better_than_chance(rule):
    """Each rule guesses a goal from the text alone, such as from the value that was mentioned
    first. Two values are introduced on equal terms, so chance is one half; 0.05 more is allowed for
    60 episodes of each task."""
    shares = []
    for episode, said in training_instructions():
        guess = guess_goal(rule, said.text, episode.task)
        shares.append(goal_share(guess, episode))
    assert sum(shares) / len(shares) < 0.55
