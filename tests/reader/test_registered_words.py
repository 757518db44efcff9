"""Words that another package teaches the interpreter."""

import pytest

from roboirg.core.errors import InvalidValueError
from roboirg.reader import interpret
from roboirg.reader.vocabulary import register_words
from roboirg.tasks.splits.splits import get_episode

EPISODE = get_episode("PickXtimes", "test", 3)
TEXT = "Hoist the {} cube and put it on the target twice, then press the button."


def test_a_registered_word_is_read_like_the_known_word_it_stands_for():
    """*Hoist* is registered as *lift*, and *vermilion* as the goal's color."""
    color = EPISODE.goal.text("color")
    text = TEXT.format("vermilion")
    before = interpret(text, EPISODE.scene, "PickXtimes")
    assert (before.goals, before.unknown_words) == ((), ("hoist", "vermilion"))

    for _ in range(2):  # the same again changes nothing
        register_words({"hoist": "lift", "vermilion": color})
    known = interpret(TEXT.replace("Hoist", "Lift").format(color), EPISODE.scene, "PickXtimes")
    assert len(known.goals) == 1
    assert interpret(text, EPISODE.scene, "PickXtimes") == known


@pytest.mark.parametrize(
    ("word", "meaning", "sentence"),
    [
        ("lift", "put", "already knows the word 'lift'"),
        ("block", "box", "already knows the word 'block'"),
        ("two", "three", "already knows the word 'two'"),
        ("hoist", "elevate", "'hoist' is to be read as 'elevate', a word that"),
    ],
)
def test_registering_a_known_word_or_an_unknown_meaning_is_refused(word, meaning, sentence):
    with pytest.raises(InvalidValueError, match=sentence):
        register_words({word: meaning})
