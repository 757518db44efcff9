"""Comparisons of two policies: which is better, what stays open, what is refused."""

from __future__ import annotations

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


def case(name: str, result) -> tuple[list, list]:
    """Return the results of the good policy and of the poor one."""
    settings = ("explicit", "direct", "reasoning", "contextual")
    good, poor = {
        # Settings in which they differ, and do not.
        "better": ([("1" * 20, {}), ("1" * 20, {"setting": "direct"})],
                   [("1" * 20, {}), ("1" * 5 + "0" * 15, {"setting": "direct"})]),
        # 3 of 20 against 6 of 20, differing on 5: a gap of 15 points with a discordance of 25.
        # By the normal approximation it takes 7.85 * 0.25 / 0.15**2 = 87 episodes.
        "open": ([("111" + "0" * 17, {})], [("11" + "0" * 14 + "1111", {})]),
        "tasks": ([("1" * 15 + "0" * 5, {}), ("0" * 20, {"task": "BinFill"})],
                  [("0" * 20, {}), ("1" * 20, {"task": "BinFill"})]),
        # Trials without a counterpart, and one without a verdict.
        "left out": ([("1111!1", {}), ("11", {"setting": "direct"})], [("0000-", {})]),
        # 6 of 20 episodes differ, all to one side: p = 0.031 alone, 0.125 among four settings.
        "interval and p": (
            [("1" * 20, {"setting": one}) for one in settings],
            [("1" * 14 + ("0" if one == "direct" else "1") * 6, {"setting": one})
             for one in settings]),
    }[name]  # fmt: skip
    return tuple(
        [one for outcomes, fields in side for one in play(result, policy, outcomes, **fields)]
        for policy, side in ((GOOD, good), (POOR, poor))
    )


@pytest.mark.parametrize("name", ["better", "open", "tasks", "left out", "interval and p"])
def test_what_is_said_is_as_stored(result, snapshot, name: str) -> None:
    """Which is better, what stays open and what it would take, and what is left out."""
    assert text(*case(name, result)) == snapshot


def test_gaps_are_signed_averages_over_tasks_with_holms_correction_over_settings(result) -> None:
    first, second = case("better", result)
    explicit, direct = compared(first, second).averages
    assert (explicit.gap.value, direct.gap.value) == (0, 0.75)
    assert direct.p_holm == pytest.approx(2 * 2 / 2**15)
    assert compared(second, first).averages[1].gap.value == -0.75
    (average,) = compared(*case("tasks", result)).averages
    assert (average.gap.value, average.tasks) == (-0.125, ("PickXtimes", "BinFill"))


def test_control_arms_are_left_out(result) -> None:
    first, second = play(result, GOOD, "11"), play(result, POOR, "01")
    silent = play(result, GOOD, "00", arm="silent")
    assert compared([*first, *silent], second) == compared(first, second)
    assert compared(silent, silent).averages, "unless there is nothing else"


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
