"""The language card and the examples on the pages of the settings are up to date."""

from pathlib import Path

import language_examples
import pytest
import write_language_card as card

from roboirg.language import instruct, plain_settings
from roboirg.language.scenarios.scenario_file import written_words
from roboirg.language.settings import all_settings
from roboirg.tasks import all_tasks

PAGE = Path(__file__).parents[2] / "docs" / "language-card.md"
MEASURED = "\n## What is said, measured\n"


def test_the_page_is_what_the_generator_gives():
    """The page begins with the card, and ends with measured figures that take longer to make."""
    assert PAGE.read_text().startswith(card.language_card()), "run: make card"


@pytest.mark.slow
def test_the_measured_part_is_what_scenarios_say():
    assert PAGE.read_text() == card.whole_page(), "run: make card"


def test_the_measured_part_has_all_tasks_that_have_words_and_no_shared_sentence():
    """Each of five tables has a row for each task, below its head and the line under it. Sentences
    come from pools for learning and for testing, compared in three ways: none is in two pools."""
    part = PAGE.read_text().partition(MEASURED)[2]
    written = [*written_words()]
    for table in ("Texts", "Length", "Frames", "Words", "Scenes that leave one goal"):
        rows = part.partition(f"### {table}\n")[2].partition("###")[0]
        assert [line.split("|")[1].strip() for line in rows.split("\n") if line[:1] == "|"][2:] == (
            written
        )

    shared = part.partition("### Shared between the pools\n")[2].partition("###")[0]
    assert shared.count(" | 0 |\n") == 3


def test_every_variant_has_an_example():
    """A variant is a task in one of its implicit settings, of which there are 40; each has an
    example in explicit words and one in resolved ones. Of the harder settings, *direct-rival* is
    there for all 11 tasks of the benchmark, and *grounded* for 10."""
    page = PAGE.read_text()
    pairs = [
        (name, options)
        for name, task in all_tasks().items()
        for options in plain_settings(task)[1:]
    ]
    for task, setting in pairs:
        assert page.count(f"### {task}, {setting}\n") == 1
        episode = card.example_episode(task, setting)
        assert f"`{episode.key}`" in page
    assert page.count("| explicit | ") == 40

    options = page.split("## Harder settings\n")[1].partition(MEASURED)[0]
    assert page.count("| resolved | ") == 40 + options.count("### ")
    assert options.count(", direct-rival\n") == 11
    assert options.count(", grounded\n") == 10


@pytest.mark.parametrize("path", card.EXAMPLES, ids=lambda path: path.name)
def test_a_page_of_the_settings_has_the_texts_that_the_program_says(path):
    """The examples of a page are written anew into it, which must not change it."""
    page = path.read_text()
    assert page == card.EXAMPLES[path](page), "run: make card"


def test_the_walk_has_every_setting_and_how_each_implicit_one_leads_to_the_goal():
    page = (PAGE.parent / "language.md").read_text()
    for name, said in language_examples.walk().items():
        rows = [line for line in page.splitlines() if line.startswith(f"| `{name}` |")]
        assert language_examples.marked_turns(said)[-1] in rows[0]
        assert len(rows) >= 1 + all_settings()[name].implicit


def test_marks_are_around_the_mentions():
    """A mention is a word that stands for a part of the goal. An anaphor, such as "it", is in bold,
    others are in italics; without the stars it is the text that is said."""
    said = instruct(card.example_episode("PickXtimes", "direct"), "direct")
    marked = language_examples.marked(said)

    assert marked.replace("*", "") == said.text
    for mention in said.mentions:
        sign = "**" if mention.role == "anaphor" else "*"
        assert f"{sign}{said.span(mention)}{sign}" in marked
