"""Words that pages and tests teach the interpreter are unknown to each test of it."""

import pytest

from roboirg.reader import tokens

TAUGHT = ("hoist", "crimson", "vermilion")


@pytest.fixture(autouse=True)
def own_words(monkeypatch):
    """Each test has its own table of synonyms, without the words that other tests teach."""
    known = {word: meaning for word, meaning in tokens.SYNONYMS.items() if word not in TAUGHT}
    monkeypatch.setattr(tokens, "SYNONYMS", known)
