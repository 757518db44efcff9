"""Words that another package teaches the interpreter."""

import pytest

from roboirg.core.episode import Goal
from roboirg.core.errors import InvalidValueError
from roboirg.reader import interpret
from roboirg.reader.vocabulary import register_words
from roboirg.tasks.splits.splits import get_episode

SCENE = get_episode("PickXtimes", "test", 3).scene
"""The scene has a green, a blue and a red cube."""
TEXT = "Hoist the vermilion cube and put it on the target twice, then press the button."


def test_a_word_that_is_not_registered_is_unknown():
    """The same text is understood in the next test."""
    found = interpret(TEXT, SCENE, "PickXtimes")

    assert found.goals == ()
    assert found.unknown_words == ("hoist", "vermilion")


def test_a_registered_word_is_read_like_the_known_word_it_stands_for():
    """As if the command were *Lift the blue cube …*"""
    register_words({"hoist": "lift", "vermilion": "blue"})
    assert interpret(TEXT, SCENE, "PickXtimes").goals == (Goal.of(color="blue", repeats=2),)


def test_the_same_words_may_be_registered_again():
    """As two packages may do that teach the same word."""
    register_words({"hoist": "lift", "vermilion": "blue"})
    register_words({"hoist": "lift", "vermilion": "blue"})
    assert len(interpret(TEXT, SCENE, "PickXtimes").goals) == 1


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
    """A known word would change its meaning; an unknown meaning says nothing."""
    with pytest.raises(InvalidValueError, match=sentence):
        register_words({word: meaning})
