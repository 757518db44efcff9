"""The language card and the examples on the pages of the settings are up to date."""

import re
from pathlib import Path

import language_examples
import pytest
import write_language_card as card

from roboirg.language import instruct, plain_settings
from roboirg.language.scenarios.scenario_file import written_words
from roboirg.language.settings import all_settings
from roboirg.tasks import all_tasks

PAGE = Path(__file__).parents[2] / "docs" / "language-card.md"


def text_between(first_heading, last_heading):
    """Return what stands in docs/language-card.md from one heading to another."""
    page = PAGE.read_text()
    return page[page.index(f"\n{first_heading}\n") : page.index(f"\n{last_heading}\n")]


def test_the_page_is_what_the_generator_gives():
    """The page begins with the card, and ends with measured figures that take longer to make."""
    assert PAGE.read_text().startswith(card.language_card()), "run: make card"


@pytest.mark.slow
def test_the_measured_part_is_what_scenarios_say():
    """The whole page docs/language-card.md is generated anew, with the figures at its end."""
    assert PAGE.read_text() == card.whole_page(), "run: make card"


@pytest.mark.parametrize(
    ("table", "next_heading"),
    [
        ("### Texts", "### Length"),
        ("### Length", "### Expressions"),
        ("### Frames", "### Words"),
        ("### Words", "### Shared between the pools"),
        ("### Scenes that leave one goal", "### Ratings and readings"),
    ],
)
def test_a_table_of_what_is_said_has_a_row_for_each_task_that_has_words(table, next_heading):
    """The first cells of the rows are *task*, the head, and then the names of all tasks for which
    sentences are written, in their order; a cell of the line below the head has no letters."""
    first_cells = re.findall(r"^\| (\w+) \|", text_between(table, next_heading), re.MULTILINE)

    assert first_cells == ["task", *written_words()]


def test_no_sentence_is_in_the_pools_for_training_and_for_testing_alike():
    """A row of the table compares the two pools in one way: by texts, by sentences whose slots are
    blanked, and by frames. Its last cell is how many of the test pool are in the training pool."""
    section = text_between("### Shared between the pools", "### Places")

    in_both_pools = re.findall(r"\| (\d+) \|$", section, re.MULTILINE)

    assert in_both_pools == ["0", "0", "0"]


def test_every_variant_has_an_example_in_explicit_and_in_resolved_words():
    """A variant is a task told in a setting that leaves something implicit. 7 tasks have four such
    settings and 4 have three, which makes 40 variants. An example is a heading and a table with a
    row in explicit and one in resolved words."""
    examples = text_between("## PickXtimes", "## Reasoning patterns by task")

    assert examples.count("\n### ") == 7 * 4 + 4 * 3
    assert examples.count("\n| explicit | ") == 40
    assert examples.count("\n| resolved | ") == 40


def test_the_example_of_a_variant_names_the_episode_that_it_shows():
    """Each of the tasks is told in words that leave nothing implicit (the first of its settings),
    and in settings that do. For each of these the page has one heading, and below it the episode.
    """
    page = PAGE.read_text()
    for name, task in all_tasks().items():
        _explicit, *implicit_settings = plain_settings(task)
        for setting in implicit_settings:
            episode = card.example_episode(name, setting).key
            assert page.count(f"### {name}, {setting}\n\nEpisode `{episode}`, ") == 1


def test_the_harder_settings_have_an_example_for_each_task_that_can_be_told_in_them():
    """*direct-rival* is there for all 11 tasks of the benchmark; *grounded* for 10, all but
    StopCube. Each of the 21 examples has a row in resolved words."""
    examples = text_between("## Harder settings", "## What is said, measured")

    assert examples.count(", direct-rival\n") == 11
    assert examples.count(", grounded\n") == 10
    assert examples.count("\n| resolved | ") == examples.count("\n### ") == 21


@pytest.mark.parametrize("path", card.EXAMPLES, ids=lambda path: path.name)
def test_a_page_of_the_settings_has_the_texts_that_the_program_says(path):
    """The examples of a page are written anew into it, which must not change it."""
    page = path.read_text()
    assert page == card.EXAMPLES[path](page), "run: make card"


def test_the_walk_has_every_setting_and_how_each_implicit_one_leads_to_the_goal():
    """The page of the language tells one goal in every setting, a row of a table for each.

    A row has the last utterance of the generated instruction, with its marks. An implicit setting
    has at least one more row, for the steps that lead from its words to the goal.
    """
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
