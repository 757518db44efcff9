"""Comparisons of two policies: which is better, what stays open, what is refused."""

from __future__ import annotations

import re

import pytest

from roboirg.core.errors import InvalidValueError
from roboirg.evaluation.analysis.results.frame import make_frame
from roboirg.evaluation.analysis.stats.comparison import compare
from roboirg.evaluation.analysis.stats.comparison_text import sentences

GOOD, POOR = "listener", "forgetful"


def play(result, policy: str, outcomes: str, **fields) -> list:
    names = {"1": "success", "0": "failure", "!": "error"}
    return [
        result(names[letter], episode, policy=policy, **fields)
        for episode, letter in enumerate(outcomes)
        if letter in names
    ]


def compared(first: list, second: list):
    return compare(make_frame([("a", first)]), make_frame([("b", second)]))


def text(first: list, second: list) -> str:
    return "\n".join(sentences(compared(first, second), GOOD, POOR))


def test_the_better_policy_is_named(result) -> None:
    first = play(result, GOOD, "1" * 20) + play(result, GOOD, "1" * 20, setting="direct")
    second = play(result, POOR, "1" * 20) + play(result, POOR, "1" * 5 + "0" * 15, setting="direct")
    explicit, direct = compared(first, second).averages
    assert (explicit.gap.value, direct.gap.value) == (0, 0.75)
    assert direct.p_holm == pytest.approx(2 * 2 / 2**15)
    assert "direct: listener is better, −75.0 points" in "\n".join(
        sentences(compared(second, first), POOR, GOOD)
    )
    assert (
        text(first, second)
        == """\
listener against forgetful, on the same episodes.

explicit: no clear difference, ±0.0 points (95 % interval −16.1 to +16.1), p = 1.000, 20 episodes. \
With so few episodes, no gap can be detected with 80 % power; the two did equally well.
direct: listener is better, +75.0 points (95 % interval +55.0 to +95.0), p < 0.001, 20 episodes.

p-values are from the exact paired test, after Holm's correction over the settings."""
    )


def test_an_open_comparison_says_what_it_would_take(result) -> None:
    """3 of 20 against 6 of 20, differing on 5: a gap of 15 points with a discordance of 25."""
    first, second = "11100000000000000000", "11000000000000001111"
    words = text(play(result, GOOD, first), play(result, POOR, second))
    assert "explicit: no clear difference, −15.0 points" in words
    # Not even all 5 to one side are found in 4 of 5 cases.
    assert "With so few episodes, no gap can be detected with 80 % power" in words
    needed = int(re.search(r"this size needs about (\d+)\.", words)[1])
    assert 80 <= needed <= 110  # by the normal approximation 7.85 · 0.25 / 0.15² = 87


def test_averages_are_over_tasks_and_cells_are_named(result) -> None:
    first = [*play(result, GOOD, "1" * 20), *play(result, GOOD, "0" * 10, task="BinFill")]
    second = [*play(result, POOR, "0" * 20), *play(result, POOR, "0" * 10, task="BinFill")]
    (average,) = compared(first, second).averages
    assert (average.gap.value, average.tasks) == (0.5, ("PickXtimes", "BinFill"))
    words = text(first, second)
    assert "30 episodes of 2 tasks" in words
    assert "1 of 2 single cells (one task in one setting) shows a difference:" in words
    assert "  PickXtimes, explicit: listener is better, +100.0 points" in words
    assert "None of 2 single cells" in text(first, first)


def test_what_has_no_counterpart_or_no_verdict_is_left_out_and_counted(result) -> None:
    first = play(result, GOOD, "1111!1") + play(result, GOOD, "11", setting="direct")
    words = text(first, play(result, POOR, "0000-"))
    assert "1 trial without a counterpart is left out." in words
    assert "Incomplete: 1 trial without a verdict (an error, or still to be played)" in words


def test_control_arms_are_left_out(result) -> None:
    first, second = play(result, GOOD, "11"), play(result, POOR, "01")
    silent = play(result, GOOD, "00", arm="silent")
    assert compared([*first, *silent], second) == compared(first, second)


def test_policies_without_a_common_episode_are_refused(result) -> None:
    for changes in ({"task": "BinFill"}, {"setting": "direct"}):
        with pytest.raises(InvalidValueError, match="no episode in common"):
            compared(play(result, GOOD, "11"), play(result, POOR, "11", **changes))


def test_a_side_is_one_policy_of_one_version(result) -> None:
    one = play(result, GOOD, "11")
    for side, words in (
        ([*one, *play(result, POOR, "11")], "name one as RUN:forgetful"),
        ([*one, *play(result, GOOD, "--1", policy_version="2")], "in several versions"),
        ([], "no results"),
    ):
        with pytest.raises(InvalidValueError, match=words):
            compared(side, one)


def test_an_interval_that_excludes_0_next_to_a_large_p_is_explained(result) -> None:
    """6 of 20 episodes differ, all to one side: p = 0.031 alone, 0.125 among four settings."""
    first, second = (
        [
            one
            for setting in ("explicit", "direct", "reasoning", "contextual")
            for one in play(
                result, policy, worse if setting == "direct" else "1" * 20, setting=setting
            )
        ]
        for policy, worse in ((GOOD, "1" * 20), (POOR, "1" * 14 + "0" * 6))
    )
    words = text(first, second)
    assert re.search(r"^direct: no clear.*p = 0\.125 \(uncorrected 0\.031\)", words, re.M)
    assert words.count("uncorrected") == 1
    assert "An interval belongs to one gap alone" in words
    assert "An interval belongs to one gap alone" not in text(first, first)
