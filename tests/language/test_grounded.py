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

GROUNDED = tuple(task for task in TASKS if "grounded" in settings_of(get_task(task)))
SCENES = 60
OPTIONS = InstructionOptions("grounded")


@functools.cache
def told(task):
    """The grounded instructions of random scenes with their episodes."""
    return [
        (episode, instruct_with(episode, OPTIONS))
        for episode in random_episodes(task, SCENES)
        if find_refusal(episode, OPTIONS) is None
    ]


@pytest.mark.parametrize("task", GROUNDED)
def test_exactly_the_touched_slots_are_hidden(task):
    for episode, said in told(task):
        touched = said.metadata["touched"]
        assert touched
        pointed = {mention.slot for mention in said.mentions if mention.role == "anaphor"}
        assert pointed - {"reference"} <= {*touched, "colors"}
        assert said.metadata["hidden_slots"] >= 1
        assert row(episode, said)["touched"] == ", ".join(touched)


@pytest.mark.parametrize("task", GROUNDED)
def test_no_thing_is_described_by_a_color(task):
    for episode, said in told(task):
        colors = [value for value in values_of_goal(episode.goal) if value.slot in COLOR_SLOTS]
        for mention in said.mentions:
            # Of two things the words state one.
            is_described = mention.slot in said.metadata["touched"] and len(colors) == 1
            if mention.slot in COLOR_SLOTS and is_described:
                assert not set(said.span(mention).split()) & set(ALL_COLORS)


@pytest.mark.parametrize(
    ("task", "slot"),
    [(task, slot) for task in GROUNDED for slot, _ in get_episode(task, "test", 0).goal.slots],
)
def test_the_words_do_not_go_with_the_goal(task, slot):
    """A guess from the description, with hindsight, is hardly better than the commonest value."""
    values = defaultdict(Counter)
    prior = Counter()
    for episode, said in told(task):
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


def test_what_has_nothing_to_see_is_refused():
    assert "grounded" not in settings_of(get_task("StopCube"))
    for task in ("PickXtimes", "SwingXtimes"):
        for episode, said in told(task):
            assert said.metadata["touched"] == ["color"]
            assert episode.difficulty != "easy"
    for _, said in told("VideoRepick"):
        assert said.metadata["touched"] == ["repeats"]
