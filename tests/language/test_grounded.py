"""The grounded setting: what decides is seen, the words alone give nothing away."""

import functools
import re
from collections import Counter, defaultdict
from pathlib import Path

import pytest
from language_variants import TASKS, random_episodes

from roboirg.core.episode import ALL_COLORS
from roboirg.core.instruction_options import InstructionOptions
from roboirg.language import instruct
from roboirg.language.generator import find_refusal
from roboirg.language.instruction_row import row
from roboirg.language.settings import settings_of
from roboirg.language.token_counts import USUAL_LIMIT, count_tokens
from roboirg.reader import interpret
from roboirg.tasks import get_task
from roboirg.tasks.splits.splits import get_episode

GROUNDED = tuple(task for task in TASKS if "grounded" in settings_of(get_task(task)))
DOCS = Path(__file__).parents[2] / "docs/grounded.md"
SCENES = 60
DIFFICULTIES = ("easy", "medium", "hard")


@functools.cache
def told(task):
    """The grounded instructions of random scenes with their episodes, and all the episodes."""
    episodes = list(random_episodes(task, SCENES))
    options = InstructionOptions("grounded")
    found = [(one, instruct(one, "grounded")) for one in episodes if not find_refusal(one, options)]
    return found, episodes


def table():
    """The rows of the table of docs/grounded.md, by task and slot."""
    text = DOCS.read_text().partition("| task | slot | easy / medium / hard |")[2]
    rows = (line.split(" | ") for line in text.split("\n\n")[0].splitlines()[2:])
    return {
        (task.strip("| "), slot.strip("`")): (shares, decides.strip(" |"))
        for task, slot, shares, decides in rows
    }


def test_the_table_has_every_slot_of_every_task():
    slots = {(task, slot) for task in TASKS for slot, _ in told_goal(task)}
    assert slots == set(table())


def told_goal(task):
    return get_episode(task, "test", 0).goal.slots


@pytest.mark.parametrize("task", GROUNDED)
def test_the_table_says_what_decides(task):
    found, episodes = told(task)
    scenes = Counter(one.difficulty for one in episodes)
    for slot, _ in told_goal(task):
        shares, decides = table()[task, slot]
        touched = [(one, said) for one, said in found if slot in said.metadata["touched"]]
        alone = [said for _, said in touched if said.metadata["touched"] == [slot]]
        kinds = {kind for said in alone for kind in said.metadata["patterns"]}
        named = set(re.findall(r"\*\*(.+?)\*\*", decides))
        assert kinds <= named
        assert bool(named) == bool(touched)
        counts = Counter(one.difficulty for one, _ in touched)
        stated = [int(share) for share in shares.split(" / ")] if "/" in shares else [0, 0, 0]
        for difficulty, share in zip(DIFFICULTIES, stated, strict=True):
            assert (share == 0) == (counts[difficulty] == 0) or share < 5
            # Thirty easy scenes, fifteen of the others: room for chance.
            assert abs(counts[difficulty] / scenes[difficulty] - share / 100) < 0.4


@pytest.mark.parametrize("task", GROUNDED)
def test_exactly_the_touched_slots_are_hidden(task):
    for episode, said in told(task)[0]:
        touched = said.metadata["touched"]
        named = {one.slot for one in said.mentions if one.utterance == 0}
        assert touched
        assert named - {"colors", "color"} <= set(touched)
        pointed = [one for one in said.mentions if one.role == "anaphor"]
        assert {one.slot for one in pointed} == set(touched)
        assert row(episode, said)["touched"] == ", ".join(touched)


@pytest.mark.parametrize("task", GROUNDED)
def test_no_thing_is_described_by_a_color(task):
    for _, said in told(task)[0]:
        for mention in said.mentions:
            if mention.slot in ("color", "colors") and mention.slot in said.metadata["touched"]:
                assert not set(said.span(mention).split()) & set(ALL_COLORS)


@pytest.mark.parametrize("task", GROUNDED)
def test_the_words_fit_what_policies_read(task):
    assert all(count_tokens(said.text) <= USUAL_LIMIT for _, said in told(task)[0])


@pytest.mark.parametrize(
    ("task", "slot"),
    [(task, slot) for task in GROUNDED for slot, _ in told_goal(task)],
)
def test_the_words_do_not_go_with_the_goal(task, slot):
    """A guess from the description, with hindsight, is hardly better than the commonest value."""
    values = defaultdict(Counter)
    for episode, said in told(task)[0]:
        if slot in said.metadata["touched"]:
            words = " ".join(
                said.span(one) for one in said.mentions if one.utterance == 0 and one.slot == slot
            )
            # Left and right, near and far, and colors are exchangeable; many texts are rare.
            words = re.sub(r"\b(?:red|green|blue|left|right|farthest|closest)\b", "_", words)
            values[words[:24]][str(episode.goal[slot])] += 1
    groups = [group for group in values.values() if group.total() >= 20]
    for group in groups:
        size = group.total()
        prior = Counter(str(one.goal[slot]) for one, said in told(task)[0]
                        if slot in said.metadata["touched"])  # fmt: skip
        expected = max(prior.values()) / prior.total()
        # Four standard deviations: fixed seeds, and the same for all groups.
        assert (
            max(group.values()) / size <= expected + 4 * (expected * (1 - expected) / size) ** 0.5
        )


def test_what_has_nothing_to_see_is_refused():
    assert "grounded" not in settings_of(get_task("StopCube"))
    for task in ("PickXtimes", "SwingXtimes"):
        for episode, said in told(task)[0]:
            assert said.metadata["touched"] == ["color"]
            assert episode.difficulty != "easy"
    for _, said in told("VideoRepick")[0]:
        assert said.metadata["touched"] == ["repeats"]


@pytest.mark.parametrize(
    "words",
    [
        "the cube in the middle from left to right",
        "the cube that has as many cubes to its left as to its right",
        "the cube that is neither closest to you nor closest to the button",
    ],
)
def test_what_is_not_there_is_named(words):
    episode = next(one for one in random_episodes("PickXtimes", 8) if one.difficulty == "easy")
    text = f"Put {words} on the target twice, then press the button."
    found = interpret(text, episode.scene, episode.task)
    assert found.goals == ()
    assert found.not_understood == (f'sees nothing or several things for "{words}"',)
