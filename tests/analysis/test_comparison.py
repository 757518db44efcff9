"""Comparisons of two policies: which is better, what stays open, what is refused."""

from __future__ import annotations

import pytest
from flat_jobs import make_results

from roboirg.analysis.measures.comparison import compare
from roboirg.analysis.measures.comparison_text import sentences
from roboirg.analysis.results.frame import make_frame
from roboirg.core.errors import InvalidValueError

HEAD = "listener against forgetful, on the same episodes."
KIND_OF_TEST = "p-values are from the exact paired test, after Holm's correction over the settings."


def forgetful_results(outcomes, setting="explicit", **fields):
    """Return results of the forgetful policy, one for each letter: 1 won, 0 lost, ! an error."""
    return make_results(outcomes, setting, policy="forgetful", **fields)


def comparison_of(first, second):
    return compare(make_frame([("a", first)]), make_frame([("b", second)]))


def sentences_of(listener, forgetful):
    """Return the lines of a comparison that are not blank."""
    lines = sentences(comparison_of(listener, forgetful), "listener", "forgetful")
    return [line for line in lines if line]


def test_a_comparison_names_the_better_policy_of_a_setting_or_says_that_there_is_none():
    """The listener wins all of 20 episodes in both settings; 1 stands for a win, 0 for a loss.

    The forgetful policy wins all explicit ones too, but 5 of 20 direct ones: a gap of 75 points.
    """
    listener = [*make_results("1" * 20), *make_results("1" * 20, "direct")]
    forgetful = [*forgetful_results("1" * 20), *forgetful_results("1" * 5 + "0" * 15, "direct")]

    assert sentences_of(listener, forgetful) == [
        HEAD,
        (
            "explicit: no clear difference, ±0.0 points (95 % interval −16.8 to +16.8), p = 1.000, "
            "20 episodes. With so few episodes, no gap can be detected with 80 % power; the two "
            "did "
            "equally well."
        ),
        (
            "direct: listener is better, +75.0 points (95 % interval +45.6 to +90.3), p < 0.001, "
            "20 episodes."
        ),
        KIND_OF_TEST,
        "However often one looked: explicit p = 1.000; direct p = 0.003.",
    ]


def test_a_comparison_without_a_winner_says_how_many_episodes_would_show_such_a_gap():
    """The listener wins 3 of 20 episodes, the other policy 6: 2 of them both, so 5 differ.

    That is a gap of 15 points with a discordance of 25 %. By the normal approximation it takes
    7.85 * 0.25 / 0.15**2 = 87 episodes to show it with 80 % power; exactly computed, 92.
    """
    listener = make_results("11100000000000000000")
    forgetful = forgetful_results("11000000000000001111")

    assert sentences_of(listener, forgetful) == [
        HEAD,
        (
            "explicit: no clear difference, −15.0 points (95 % interval −39.0 to +9.4), p = 0.375, "
            "20 episodes. With so few episodes, no gap can be detected with 80 % power; showing a "
            "gap "
            "of this size needs about 92."
        ),
        KIND_OF_TEST,
        "However often one looked: explicit p = 0.874.",
    ]


def test_a_comparison_lists_single_tasks_that_show_a_difference():
    """The listener is better in one task (15 of 20 against 0), the other in BinFill (0 against 20).

    On average this is (75 - 100) / 2 = -12.5 points, no clear difference.
    """
    listener = [*make_results("1" * 15 + "0" * 5), *make_results("0" * 20, task="BinFill")]
    forgetful = [*forgetful_results("0" * 20), *forgetful_results("1" * 20, task="BinFill")]

    assert sentences_of(listener, forgetful) == [
        HEAD,
        (
            "explicit: no clear difference, −12.5 points (95 % interval −27.2 to +5.0), p = 0.500, "
            "40 episodes of 2 tasks. These episodes can show gaps of 42.3 points or more with 80 % "
            "power; showing a gap of this size needs about 452."
        ),
        "2 of 2 single cells (one task in one setting) show a difference:",
        (
            "  BinFill, explicit: forgetful is better, −100.0 points (95 % interval −100.0 to "
            "−66.4), "
            "p < 0.001, 20 episodes."
        ),
        (
            "  PickXtimes, explicit: listener is better, +75.0 points (95 % interval +45.6 to "
            "+90.3), "
            "p < 0.001, 20 episodes."
        ),
        (
            "p-values are from the exact paired test, after Holm's correction: over the averages, "
            "and "
            "over the single cells. An average is the unweighted mean over tasks."
        ),
        "However often one looked: explicit p = 1.000.",
    ]


def test_a_comparison_says_which_trials_it_leaves_out():
    """Both policies played episodes 0 to 3 in explicit: the listener won them (1), the other lost.

    The listener also tried episode 4, which ended in an error (!), and won episode 5. What it
    played in direct is not mentioned, as the other policy played nothing there.
    """
    listener = [*make_results("1111!1", "explicit"), *make_results("11", "direct")]
    forgetful = forgetful_results("0000", "explicit")

    lines = sentences_of(listener, forgetful)

    assert lines[-2:] == [
        "1 trial without a counterpart is left out.",
        "Incomplete: 1 trial without a verdict (an error, or still to be played) is left out.",
    ]


def test_a_comparison_explains_an_interval_that_excludes_0_although_the_gap_is_not_significant():
    """In direct the listener wins all 20 episodes, the other policy 14: a gap of 30 points.

    6 episodes that differ to the same side have p = 2 / 2**6 = 0.031 in the exact test. Holm's
    correction multiplies it by the 4 settings that are compared; in the other 3 both win all. The
    interval is not corrected, and so excludes 0.
    """
    listener = make_results("1" * 20, "direct")
    forgetful = forgetful_results("1" * 14 + "0" * 6, "direct")
    for setting in ("explicit", "reasoning", "contextual"):
        listener += make_results("1" * 20, setting)
        forgetful += forgetful_results("1" * 20, setting)

    text = "\n".join(sentences_of(listener, forgetful))

    assert (
        "direct: no clear difference, +30.0 points (95 % interval +7.8 to +52.6), "
        "p = 0.125 (uncorrected 0.031), 20 episodes."
    ) in text
    assert (
        "An interval belongs to one gap alone, so it may exclude 0 although p is above 0.05; p is "
        "corrected for all gaps that are tested together, and p decides."
    ) in text


def test_episodes_without_instruction_do_not_count_in_a_comparison():
    """The listener wins both episodes (1) with the instruction, and loses both (0) without it.

    The second is a control (the arm *silent*): it would drag down the policy that played it.
    """
    listener = make_results("11")
    silent = make_results("00", arm="silent")
    forgetful = forgetful_results("01")

    with_silent = sentences_of([*listener, *silent], forgetful)

    assert with_silent == sentences_of(listener, forgetful)


def test_episodes_without_instruction_are_compared_if_there_is_nothing_else():
    silent = make_results("00", arm="silent")

    assert comparison_of(silent, silent).averages


@pytest.mark.parametrize("changes", [{"task": "BinFill"}, {"setting": "direct"}])
def test_policies_without_a_common_episode_are_refused(changes):
    with pytest.raises(InvalidValueError, match="no episode in common"):
        comparison_of(make_results("11"), forgetful_results("11", **changes))


@pytest.mark.parametrize(
    ("added", "reason"),
    [
        (forgetful_results("11"), "name one as RUN:forgetful"),
        (make_results("--1", policy_version="2"), "in several versions"),
    ],
    ids=["two policies", "two versions"],
)
def test_each_side_of_a_comparison_must_be_one_policy_of_one_version(added, reason):
    listener = make_results("11")

    with pytest.raises(InvalidValueError, match=reason):
        comparison_of([*listener, *added], listener)


def test_a_side_without_results_is_refused():
    with pytest.raises(InvalidValueError, match="no results"):
        comparison_of([], make_results("11"))
