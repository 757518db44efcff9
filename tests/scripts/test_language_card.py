"""The language card is up to date."""

from pathlib import Path

import write_language_card as card

from roboirg.language import instruct, variants

PAGE = Path(__file__).parents[2] / "docs" / "language-card.md"


def test_the_page_is_what_the_generator_gives():
    assert PAGE.read_text() == card.language_card(), "run: make card"


def test_every_variant_has_an_example():
    page = PAGE.read_text()
    for task, setting in variants.all_variants():
        assert page.count(f"### {task}, {setting}\n") == 1
        episode = card.example_episode(task, setting)
        assert f"`{episode.key}`" in page
    assert page.count("| explicit | ") == 40
    options = page.split("## Harder settings\n")[1]
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
