"""Comparisons of two policies: which is better, what stays open, what is refused."""

from __future__ import annotations

import pytest
from flat_jobs import make_results

from roboirg.analysis.measures.comparison import compare
from roboirg.analysis.measures.comparison_text import sentences
from roboirg.analysis.results.frame import make_frame
from roboirg.core.errors import InvalidValueError

GOOD = "listener"
POOR = "forgetful"


def comparison_of(first: list, second: list):
    return compare(make_frame([("a", first)]), make_frame([("b", second)]))


def sentences_of(first: list, second: list) -> str:
    return "\n".join(sentences(comparison_of(first, second), GOOD, POOR))


def results_of_policy(policy: str, outcomes_and_fields: list) -> list:
    found = []
    for outcomes, fields in outcomes_and_fields:
        found += make_results(outcomes, policy=policy, **fields)
    return found


SETTINGS = ("explicit", "direct", "reasoning", "contextual")


@pytest.mark.parametrize(
    ("good", "poor"),
    [
        # Settings in which they differ, and do not.
        pytest.param([("1" * 20, {}), ("1" * 20, {"setting": "direct"})],
                     [("1" * 20, {}), ("1" * 5 + "0" * 15, {"setting": "direct"})], id="better"),
        # 3 of 20 against 6 of 20, differing on 5: a gap of 15 points with a discordance of 25.
        # By the normal approximation it takes 7.85 * 0.25 / 0.15**2 = 87 episodes.
        pytest.param([("111" + "0" * 17, {})], [("11" + "0" * 14 + "1111", {})], id="open"),
        pytest.param([("1" * 15 + "0" * 5, {}), ("0" * 20, {"task": "BinFill"})],
                     [("0" * 20, {}), ("1" * 20, {"task": "BinFill"})], id="tasks"),
        # Trials without a counterpart, and one without a verdict.
        pytest.param([("1111!1", {}), ("11", {"setting": "direct"})], [("0000-", {})],
                     id="left out"),
        # 6 of 20 episodes differ, all to one side: p = 0.031 alone, 0.125 among four settings.
        pytest.param([("1" * 20, {"setting": setting}) for setting in SETTINGS],
                     [("1" * 14 + ("0" if setting == "direct" else "1") * 6, {"setting": setting})
                      for setting in SETTINGS], id="interval and p"),
    ],
)  # fmt: skip
def test_the_sentences_of_a_comparison_are_as_stored(snapshot, good, poor):
    """Which is better, what stays open and what it would take, and what is left out.

    A letter is an episode: 1 won, 0 lost, ! an error, - not played.
    """
    good_results = results_of_policy("listener", good)
    poor_results = results_of_policy("forgetful", poor)

    assert sentences_of(good_results, poor_results) == snapshot


def test_episodes_without_instruction_do_not_count_in_a_comparison():
    """The arm *silent* is a control: it would drag down the policy that played it."""
    first = make_results("11")
    second = make_results("01", policy="forgetful")
    silent = make_results("00", arm="silent")

    assert repr(comparison_of([*first, *silent], second)) == repr(comparison_of(first, second))


def test_episodes_without_instruction_are_compared_if_there_is_nothing_else():
    silent = make_results("00", arm="silent")

    assert comparison_of(silent, silent).averages


@pytest.mark.parametrize("changes", [{"task": "BinFill"}, {"setting": "direct"}])
def test_policies_without_a_common_episode_are_refused(changes):
    first = make_results("11")
    second = make_results("11", policy=POOR, **changes)

    with pytest.raises(InvalidValueError, match="no episode in common"):
        comparison_of(first, second)


@pytest.mark.parametrize(
    ("added", "reason"),
    [
        (make_results("11", policy=POOR), "name one as RUN:forgetful"),
        (make_results("--1", policy_version="2"), "in several versions"),
    ],
)
def test_each_side_of_a_comparison_must_be_one_policy_of_one_version(added, reason):
    results = make_results("11")

    with pytest.raises(InvalidValueError, match=reason):
        comparison_of([*results, *added], results)


def test_a_side_without_results_is_refused():
    with pytest.raises(InvalidValueError, match="no results"):
        comparison_of([], make_results("11"))
