"""The language card and the examples on the pages of the settings are up to date."""

from pathlib import Path

import pytest
import write_language_card as card

PAGE = Path(__file__).parents[2] / "docs" / "language-card.md"


def test_the_page_is_what_the_generator_gives():
    """The page begins with the card, and ends with measured figures that take longer to make."""
    assert PAGE.read_text().startswith(card.language_card()), "run: make card"


@pytest.mark.slow
def test_the_measured_part_is_what_scenarios_say():
    """The whole page docs/language-card.md is generated anew, with the figures at its end."""
    assert PAGE.read_text() == card.whole_page(), "run: make card"


@pytest.mark.parametrize("path", card.EXAMPLES, ids=lambda path: path.name)
def test_a_page_of_the_settings_has_the_texts_that_the_program_says(path):
    """The examples of a page are written anew into it, which must not change it."""
    page = path.read_text()
    assert page == card.EXAMPLES[path](page), "run: make card"
