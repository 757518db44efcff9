"""Counting what instructions are made of, and drawing it."""

import functools
import sys

import pytest

from roboirg.analysis.figures import figure_style
from roboirg.apps.language_lab import corpus_statistics
from roboirg.core.errors import MissingDependencyError
from roboirg.core.instruction_options import InstructionOptions
from roboirg.language import instruct, plain_settings
from roboirg.language.variants import instructions
from roboirg.tasks.splits.splits import get_episode, split_episodes

TASKS = ("PickXtimes", "BinFill", "VideoUnmask", "VideoPlaceButton", "VideoPlaceOrder")
"""The last two have no spatial setting."""


@functools.cache
def implicit_instructions():
    """Return the implicit instructions of the 50 test episodes of these tasks, in all settings."""
    episodes = list(split_episodes(TASKS, ["test"]))
    told = instructions(episodes, plain_settings(), ("implicit",), InstructionOptions())
    return tuple(said for _, said in told)


def test_expressions_are_counted_once_per_scene():
    """A referring expression is a word such as *it*: twice the same instructions count once."""
    said = implicit_instructions()
    counts = corpus_statistics.expression_counts(said)
    assert corpus_statistics.expression_counts(said * 2) == counts


def test_an_expression_is_counted_in_50_scenes_of_a_task_at_most():
    """The instructions are those of the 50 test episodes of five tasks, of which three have a
    spatial setting. A word may occur twice in an instruction and still counts once for its scene.
    """
    counts = corpus_statistics.expression_counts(implicit_instructions())

    for setting, count_by_expression in counts.items():
        tasks = 3 if setting == "spatial" else 5
        assert max(count_by_expression.values()) <= 50 * tasks, setting


@pytest.mark.parametrize(
    ("setting", "expected"),
    [
        ("direct", {"it", "them", "that", "former", "latter", "first", "second"}),
        ("reasoning", {"that", "each", "other"}),
    ],
)
def test_a_setting_has_the_words_that_refer_back_in_its_way(setting, expected):
    """Direct instructions use pronouns and *the former*, *reasoning* compares (*the other*).

    The instructions are those of 250 test scenes, which use all forms of a setting.
    """
    counts = corpus_statistics.expression_counts(implicit_instructions())

    assert expected <= set(counts[setting])


def test_spatial_instructions_refer_back_with_three_words_alone():
    """They are about places: *there*, *that cube*, *left of it*; of 150 test scenes here."""
    counts = corpus_statistics.expression_counts(implicit_instructions())

    assert set(counts["spatial"]) == {"it", "that", "there"}


def test_an_explicit_instruction_has_no_word_that_refers_back():
    """It names each thing in full, so that nothing is counted, not even the setting."""
    said = instruct(get_episode("PickXtimes", "test", 0), "explicit")

    assert corpus_statistics.expression_counts([said]) == {}


def test_expressions_are_in_a_fixed_order_and_none_is_left_out():
    """The order is that of the types, and does not depend on the counts."""
    counts = {"direct": {"there": 2, "it": 5}, "spatial": {"former": 1, "there": 1}}
    assert corpus_statistics.expression_order(counts) == ("it", "former", "there")


def test_without_matplotlib_one_sentence_says_what_to_install(monkeypatch):
    monkeypatch.setitem(sys.modules, "matplotlib", None)
    with pytest.raises(MissingDependencyError, match=r"\[report\]"):
        figure_style.check_figure_support()
