"""The setting *grounded*: a value has to be seen in the scene; the words do not give it away.

Instead of *the red cube*, the words say *the cube nearest to the back left corner*. The metadata
of the instruction lists the slots (parts of the goal, such as its color) that are hidden in this
way under the key "touched".
"""

import functools
import itertools
from collections import defaultdict

import pytest
from language_variants import TASKS, random_episodes, said_where_possible

from roboirg.core.episode import ALL_COLORS
from roboirg.core.goal_slots import COLOR_SLOTS
from roboirg.core.instruction_options import InstructionOptions
from roboirg.language import instruct
from roboirg.language.instruction_row import row
from roboirg.language.settings import settings_of
from roboirg.tasks import get_task
from roboirg.tasks.splits.splits import get_episode

TASKS_WITH_SETTING = tuple(task for task in TASKS if "grounded" in settings_of(get_task(task)))
each_task = pytest.mark.parametrize("task", TASKS_WITH_SETTING)


@functools.cache
def grounded_instructions(task):
    """Return (episode, grounded instruction) of those of 60 random episodes that have one."""
    return list(said_where_possible(random_episodes(task, 60), InstructionOptions("grounded")))


def test_a_grounded_instruction_describes_the_cube_instead_of_naming_its_color():
    """The goal is to place the blue cube once. The setting *grounded* says where it stands instead
    of *blue*, and *it* in the command refers back to it; the metadata "touched" list the slots of
    the goal that are hidden so."""
    episode = get_episode("PickXtimes", "test", 2)

    said = instruct(episode, "grounded")

    assert said.turns == (
        "The cube nearest to the back left corner is new.",
        "Let's try it out: grab it and place it on the target once, then press the button.",
    )
    assert said.metadata["touched"] == ["color"]


@each_task
def test_every_grounded_instruction_hides_at_least_one_value(task):
    """`grounded_instructions` has what the setting *grounded* says of random episodes. It describes
    what can be seen instead of naming a value of the goal; the metadata "touched" list the slots
    that are hidden so. Without any, it could be followed without looking."""
    for _, said in grounded_instructions(task):
        assert said.metadata["touched"], said.text
        assert said.metadata["hidden_slots"] >= 1, said.text


@each_task
def test_only_values_that_must_be_seen_are_replaced_by_pointers(task):
    """`grounded_instructions` has what the setting *grounded* says of random episodes. A pointer is
    a word that refers back, such as *it*: a mention with the role "anaphor". It may stand for a
    hidden slot (metadata "touched"), for one of several colors, or for a value that only leads to
    the goal, the slot "reference"."""
    for _, said in grounded_instructions(task):
        pointed = {mention.slot for mention in said.mentions if mention.role == "anaphor"}
        assert pointed <= {*said.metadata["touched"], "colors", "reference"}, said.text


def test_an_exported_grounded_instruction_lists_its_hidden_slots():
    """The goal is the blue cube, of which the setting *grounded* says *the cube nearest to the back
    left corner*: its color is hidden. The column `touched` has hidden slots, separated by
    commas."""
    episode = get_episode("PickXtimes", "test", 2)
    assert row(episode, instruct(episode, "grounded"))["touched"] == "color"


@each_task
def test_grounded_instructions_never_name_the_hidden_color(task):
    """`grounded_instructions` has what the setting *grounded* says of random episodes; the metadata
    "touched" list the slots that are hidden. *The red cube on the left* would tell the color to a
    policy that does not look. A goal with two colors is left out, since the words state one of
    them."""
    for episode, said in grounded_instructions(task):
        if len(episode.goal.as_mapping().get("colors", ())) > 1:
            continue
        for mention in said.mentions:
            if mention.slot in COLOR_SLOTS and mention.slot in said.metadata["touched"]:
                assert set(ALL_COLORS).isdisjoint(said.span(mention).split()), said.text


def values_by_description(task, slot):
    """Return the values that each description of a hidden slot stands for in random episodes.

    ``{"the cube nearest to": ["red", "blue", "red"]}``: colors, left and right are left out of
    descriptions, and what follows the 24th character, so that more of them are alike.
    """
    exchangeable = {"red", "green", "blue", "left", "right"}
    found = defaultdict(list)
    for episode, said in grounded_instructions(task):
        if slot in said.metadata["touched"]:
            spans = [
                said.span(mention)
                for mention in said.mentions
                if mention.utterance == 0 and mention.slot == slot
            ]
            kept = [word for word in " ".join(spans).split() if word not in exchangeable]
            found[" ".join(kept)[:24]].append(episode.goal[slot])
    return found


def share_of_equal_pairs(groups):
    """Return how many of the pairs of values of the same group are equal, as a share."""
    equal = []
    for values in groups:
        equal += [first == second for first, second in itertools.combinations(values, 2)]
    return sum(equal) / len(equal)


@pytest.mark.parametrize(
    ("task", "slot"),
    [
        ("PickXtimes", "color"),
        ("SwingXtimes", "color"),
        ("VideoUnmask", "colors"),
        ("VideoUnmaskSwap", "colors"),
        ("ButtonUnmask", "colors"),
        ("ButtonUnmaskSwap", "colors"),
        ("VideoRepick", "repeats"),
        ("VideoPlaceButton", "relation"),
        ("VideoPlaceOrder", "placement"),
    ],
)
def test_the_description_of_a_hidden_value_does_not_give_the_value_away(task, slot):
    """The slot of the goal is hidden: *the cube nearest to the button* may be of any color. If a
    description always stood for the same value, all pairs of episodes with the same description
    would have the same value, a share of 1. It must be about that of all pairs, 0.1 to 0.5; 0.25
    more are allowed, since *two containers* tells how many colors are meant."""
    groups = values_by_description(task, slot).values()
    all_values = list(itertools.chain.from_iterable(groups))

    assert share_of_equal_pairs(groups) < share_of_equal_pairs([all_values]) + 0.25


def test_stopcube_has_no_grounded_setting():
    """Its goal is a number of visits, and nothing in the scene shows a number."""
    assert "grounded" not in settings_of(get_task("StopCube"))


@pytest.mark.parametrize("task", ["PickXtimes", "SwingXtimes"])
def test_the_color_is_hidden_only_in_scenes_with_several_colors(task):
    """`grounded_instructions` has what the setting *grounded* says of random episodes; the metadata
    "touched" list the slots that are hidden. Easy scenes have one cube, so that its color is no
    choice, and nothing could be hidden."""
    for episode, said in grounded_instructions(task):
        assert said.metadata["touched"] == ["color"]
        assert episode.difficulty != "easy"


def test_grounded_videorepick_hides_the_number_of_repetitions():
    """*As often as the cubes switched places*: the setting *grounded* describes the number by what
    is seen in the video; the metadata "touched" list the slots that are hidden."""
    for _, said in grounded_instructions("VideoRepick"):
        assert said.metadata["touched"] == ["repeats"]
