"""The table of token pieces has every word that can be said."""

import json

import count_token_pieces


def test_the_table_has_every_word_of_the_scenarios():
    """A word that it lacks is counted far too high; checked for all people, in both numbers."""
    stored = json.loads(count_token_pieces.TABLE.read_text(encoding="utf-8"))
    known = {word for words in stored.values() for word in words}

    said = count_token_pieces.scenario_words()

    assert {"She's", "passes", "Somebody", "daughter"} <= said
    assert not said - known, "count them: python scripts/count_token_pieces.py"
