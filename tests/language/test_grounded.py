"""The grounded setting: what decides is seen, the words alone give nothing away."""

import functools
from collections import Counter, defaultdict

import pytest
from language_variants import TASKS, random_episodes

from roboirg.core.episode import ALL_COLORS
from roboirg.core.goal_slots import COLOR_SLOTS
from roboirg.core.instruction_options import InstructionOptions
from roboirg.language import instruct_with
from roboirg.language.generator import find_refusal
from roboirg.language.instruction_row import row
from roboirg.language.request import values_of_goal
from roboirg.language.settings import settings_of
from roboirg.tasks import get_task
from roboirg.tasks.splits.splits import get_episode

TASKS_WITH_SETTING = tuple(task for task in TASKS if "grounded" in settings_of(get_task(task)))
SCENES = 60
OPTIONS = InstructionOptions("grounded")


@functools.cache
def grounded_instructions(task):
    """The grounded instructions of random scenes with their episodes."""
    return [
        (episode, instruct_with(episode, OPTIONS))
        for episode in random_episodes(task, SCENES)
        if find_refusal(episode, OPTIONS) is None
    ]


@pytest.mark.parametrize("task", TASKS_WITH_SETTING)
def test_only_values_that_must_be_seen_are_replaced_by_pointers(task):
    """In the setting *grounded*, a value of the goal (its slot) is left out and has to be seen.

    The command refers back to it with a word such as *it*: a mention with the role "anaphor".
    """
    for episode, said in grounded_instructions(task):
        touched = said.metadata["touched"]
        assert touched
        pointed = {mention.slot for mention in said.mentions if mention.role == "anaphor"}
        assert pointed - {"reference"} <= {*touched, "colors"}
        assert said.metadata["hidden_slots"] >= 1
        assert row(episode, said)["touched"] == ", ".join(touched)


@pytest.mark.parametrize("task", TASKS_WITH_SETTING)
def test_grounded_instructions_never_name_the_hidden_color(task):
    """The policy has to see which color is meant, so the words about it must not contain one."""
    for episode, said in grounded_instructions(task):
        colors = [value for value in values_of_goal(episode.goal) if value.slot in COLOR_SLOTS]
        for mention in said.mentions:
            # Of two things the words state one.
            is_described = mention.slot in said.metadata["touched"] and len(colors) == 1
            if mention.slot in COLOR_SLOTS and is_described:
                assert not set(said.span(mention).split()) & set(ALL_COLORS)


@pytest.mark.parametrize(
    ("task", "slot"),
    [
        (task, slot)
        for task in TASKS_WITH_SETTING
        for slot, _ in get_episode(task, "test", 0).goal.slots
    ],
)
def test_the_description_of_a_hidden_value_does_not_give_the_value_away(task, slot):
    """Guess each value from its description by the most frequent pair, with hindsight:

    this must hardly be better than always guessing the value that is most frequent overall.
    """
    values = defaultdict(Counter)
    prior = Counter()
    for episode, said in grounded_instructions(task):
        if slot in said.metadata["touched"]:
            spans = [
                said.span(mention)
                for mention in said.mentions
                if mention.utterance == 0 and mention.slot == slot
            ]
            # Left and right, and colors are exchangeable; many texts are rare.
            exchangeable = {"red", "green", "blue", "left", "right"}
            kept = [word for word in " ".join(spans).split() if word not in exchangeable]
            values[" ".join(kept)[:24]][str(episode.goal[slot])] += 1
            prior[str(episode.goal[slot])] += 1
    for group in values.values():
        size = group.total()
        expected = max(prior.values()) / prior.total()
        # Four standard deviations: fixed seeds, and the same for all groups.
        room = 4 * (expected * (1 - expected) / size) ** 0.5
        assert size < 20 or max(group.values()) / size <= expected + room


def test_grounded_instructions_exist_only_where_a_value_can_be_seen():
    """StopCube has nothing to see. A color can be hidden where there are several (not in easy
    scenes), and VideoRepick hides only the number of repetitions."""
    assert "grounded" not in settings_of(get_task("StopCube"))
    for task in ("PickXtimes", "SwingXtimes"):
        for episode, said in grounded_instructions(task):
            assert said.metadata["touched"] == ["color"]
            assert episode.difficulty != "easy"
    for _, said in grounded_instructions("VideoRepick"):
        assert said.metadata["touched"] == ["repeats"]
