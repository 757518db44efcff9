"""Counting what instructions are made of, and drawing it."""

import functools

import pytest

from roboirg.analysis.figures import figure_style
from roboirg.apps.language_lab import corpus_statistics
from roboirg.core.errors import MissingDependencyError
from roboirg.core.instruction_options import InstructionOptions
from roboirg.language import plain_settings
from roboirg.language.variants import instructions
from roboirg.tasks.splits.splits import split_episodes

TASKS = ("PickXtimes", "BinFill", "VideoUnmask", "VideoPlaceButton", "VideoPlaceOrder")
"""The last two have no spatial setting."""


@functools.cache
def said():
    """All implicit forms of the test split of some tasks."""
    episodes = list(split_episodes(TASKS, ["test"]))
    told = instructions(episodes, plain_settings(), ("implicit",), InstructionOptions())
    return tuple(instruction for _, instruction in told)


def test_expressions_are_counted_once_per_scene():
    counts = corpus_statistics.expression_counts(said())
    assert corpus_statistics.expression_counts(said() * 2) == counts
    assert "explicit" not in counts
    for setting, by_class in counts.items():
        assert max(by_class.values()) <= 50 * (3 if setting == "spatial" else len(TASKS))
    assert {"it", "them", "that", "former", "latter", "first", "second"} <= set(counts["direct"])
    assert {"that", "each", "other"} <= set(counts["reasoning"])
    assert {"it", "that", "there"} == set(counts["spatial"])

    order = corpus_statistics.expression_order(counts)
    assert set(order) == {name for by_class in counts.values() for name in by_class}
    assert order.index("it") < order.index("former") < order.index("there")


def test_without_matplotlib_one_sentence_says_what_to_install(monkeypatch):
    monkeypatch.setitem(__import__("sys").modules, "matplotlib", None)
    with pytest.raises(MissingDependencyError, match=r"\[report\]"):
        figure_style.check_figure_support()
