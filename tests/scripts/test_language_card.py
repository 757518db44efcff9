"""The language card is up to date."""

from pathlib import Path

import pytest
import write_language_card as card

from roboirg.language import instruct, variants
from roboirg.language.scenarios.scenario_file import task_scenarios
from roboirg.tasks import all_tasks

PAGE = Path(__file__).parents[2] / "docs" / "language-card.md"


def test_the_page_is_what_the_generator_gives():
    assert PAGE.read_text().startswith(card.language_card()), "run: make card"


@pytest.mark.slow
def test_the_part_about_language_4_is_what_its_scenarios_say():
    assert PAGE.read_text() == card.whole_page(), "run: make card"


def test_the_part_about_language_4_has_all_tasks_that_have_words_and_no_shared_sentence():
    part = PAGE.read_text().partition("\n## Language 4\n")[2]
    written = [name for name in all_tasks() if task_scenarios(name) is not None]
    assert f"of {', '.join(written)}.\n" in part
    for table in ("Texts", "Length", "Frames", "Words", "Scenes that leave one goal"):
        rows = part.partition(f"### {table}\n")[2].partition("###")[0]
        assert [line.split("|")[1].strip() for line in rows.split("\n") if line[:1] == "|"][2:] == (
            written
        )
    shared = part.partition("### Shared between the pools\n")[2].partition("###")[0]
    assert shared.count(" | 0 |\n") == 3


def test_every_variant_has_an_example():
    page = PAGE.read_text()
    for task, setting in variants.all_variants():
        assert page.count(f"### {task}, {setting}\n") == 1
        episode = card.example_episode(task, setting)
        assert f"`{episode.key}`" in page
    assert page.count("| explicit | ") == 40
    options = page.split("## Harder settings\n")[1].partition("\n## Language 4\n")[0]
    assert page.count("| resolved | ") == 40 + options.count("### ")
    assert options.count(", direct-rival\n") == 11
    assert options.count(", grounded\n") == 10


def test_marks_are_around_the_mentions():
    said = instruct(card.example_episode("PickXtimes", "direct"), "direct")
    marked = card.marked(said)
    assert marked.replace("*", "") == said.text
    for mention in said.mentions:
        sign = "**" if mention.role == "anaphor" else "*"
        assert f"{sign}{said.span(mention)}{sign}" in marked
