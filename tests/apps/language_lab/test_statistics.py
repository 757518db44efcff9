"""Counting what instructions are made of, and drawing it."""

import functools

import pytest

from roboirg.apps.language_lab import expressions
from roboirg.core.errors import MissingDependencyError
from roboirg.evaluation.analysis.figures import figure_style
from roboirg.language import plain_settings
from roboirg.language.variants import instructions
from roboirg.tasks.splits.splits import split_episodes

TASKS = ("PickXtimes", "BinFill", "VideoUnmask", "VideoPlaceButton", "VideoPlaceOrder")
"""The last two have no spatial setting."""


@functools.cache
def said():
    """All implicit forms of the test split of some tasks."""
    episodes = list(split_episodes(TASKS, ["test"]))
    return tuple(one for _, one in instructions(episodes, plain_settings(), ("implicit",)))


def test_expressions_are_counted_once_per_scene():
    counts = expressions.expression_counts(said())
    assert expressions.expression_counts(said() * 2) == counts
    scenes = expressions.scene_counts(said() * 2)
    assert scenes["direct"] == 50 * len(TASKS)
    assert scenes["spatial"] == 50 * 3
    assert "explicit" not in counts
    for setting, by_class in counts.items():
        assert max(by_class.values()) <= scenes[setting]
    ranks = {"former", "latter", "first", "second", "third"}
    assert set(counts["direct"]) == {"it", "one", "them", "that", "then", *ranks}
    assert {"pair", "that", "each", "other"} == set(counts["reasoning"])
    assert {"there", *ranks} == set(counts["spatial"])
    order = expressions.expression_order(counts)
    assert set(order) == {name for by_class in counts.values() for name in by_class}
    assert order.index("it") < order.index("former") < order.index("there")


def test_the_figure_has_a_panel_for_each_setting_with_expressions(tmp_path):
    Text = pytest.importorskip("matplotlib.text").Text  # noqa: N806
    drawn = {one.get_text() for one in expressions._draw(said(), "A title").findobj(Text)}
    for setting, by_class in expressions.expression_counts(said()).items():
        scenes = expressions.scene_counts(said())[setting]
        assert {setting, f"of {scenes} scenes", *map(str, by_class.values())} <= drawn
    assert expressions.write_figure((), tmp_path, "none", "Nothing") == ()


def test_without_matplotlib_one_sentence_says_what_to_install(monkeypatch):
    monkeypatch.setitem(__import__("sys").modules, "matplotlib", None)
    with pytest.raises(MissingDependencyError, match=r"\[report\]"):
        figure_style.check_figure_support()
