"""Verdicts under other choices of the analysis: which choices there are, and what each changes."""

from __future__ import annotations

import itertools

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from roboirg.core.errors import InvalidValueError
from roboirg.evaluation.analysis.stats.paired_tests import sign_flip_test
from roboirg.evaluation.analysis.stats.run_data import RunData
from roboirg.evaluation.analysis.stats.sensitivity import (
    gap_contrasts,
    offers_for,
    policy_contrasts,
    swap_test,
    try_choices,
)
from roboirg.evaluation.analysis.tables.diagnostic_tables import make_sensitivity_table

OUTCOMES = {"1": "success", "0": "failure", "!": "error"}


def play(result, outcomes: str, **fields) -> list:
    return [result(OUTCOMES[letter], episode, **fields) for episode, letter in enumerate(outcomes)]


def gaps(results: list):
    return try_choices(gap_contrasts(results))


def exceptions(found) -> set[str]:
    return {one.label for one in found.exceptions}


def test_a_large_gap_holds_in_all(result) -> None:
    results = [
        one
        for task in (
            "PickXtimes",
            "BinFill",
            "VideoUnmask",
            "VideoRepick",
            "StopCube",
            "SwingXtimes",
        )
        for one in (
            *play(result, "1" * 20, task=task),
            *play(result, "1" * 4 + "0" * 16, task=task, setting="direct"),
        )
    ]
    (found,) = gaps(results)
    assert (found.label, found.verdict) == ("direct minus explicit", "lower")
    assert not found.exceptions
    assert found.sentence == "holds in all 8 other analyses"


def test_a_gap_of_one_task_goes_without_it(result) -> None:
    results = [
        *play(result, "1" * 20),
        *play(result, "0" * 20, setting="direct"),
        *play(result, "1" * 20, task="BinFill"),
        *play(result, "1" * 20, task="BinFill", setting="direct"),
    ]
    (found,) = gaps(results)
    assert found.verdict == "lower"
    # Two tasks are too few units of their own, and without the first one nothing differs.
    assert exceptions(found) == {"unit task", "without PickXtimes"}
    assert "does not hold in 2 of 3: unit task (open), " in found.sentence


def test_errors_decide_if_they_count_as_failures(result) -> None:
    results = [
        *play(result, "1" * 20),
        *play(result, "1" * 10 + "!" * 10, setting="direct"),
    ]
    (found,) = gaps(results)
    assert found.verdict == "open"
    (choice,) = found.exceptions
    assert (choice.label, found.others[choice]) == ("errors as failures", "lower")


def test_each_seed_alone_and_rollouts_as_units(result) -> None:
    results = []
    for seed, outcomes in enumerate(("0" * 8 + "1" * 2, "1" * 10, "1" * 10)):
        results += play(result, "1" * 10, policy_seed=seed)
        results += play(result, outcomes, policy_seed=seed, setting="direct")
    (found,) = gaps(results)
    assert {"seed 0", "seed 1", "seed 2", "unit rollout"} == {one.label for one in found.others}
    assert found.verdict == "lower"
    assert exceptions(found) == {"seed 1", "seed 2"}


def test_weights_decide_where_suites_are_uneven(result) -> None:
    """Lower in one task of counting, higher in four of permanence: the mean over tasks is 0.4."""
    unmask = ("VideoUnmask", "ButtonUnmask", "VideoUnmaskSwap", "ButtonUnmaskSwap")
    results = [*play(result, "1" * 40), *play(result, "0" * 40, setting="direct")]
    for task in unmask:
        results += play(result, "0" * 40, task=task)
        results += play(result, "1" * 30 + "0" * 10, task=task, setting="direct")
    (found,) = gaps(results)
    assert found.verdict == "higher"
    assert "equal weights of suites" in exceptions(found)


def test_only_choices_that_can_change_anything_are_tried(result) -> None:
    one_task = [*play(result, "1111"), *play(result, "0000", setting="direct")]
    assert not gaps(one_task)[0].others
    assert all(not one.differs for one in offers_for(gap_contrasts(one_task)))
    offers = {of.choices[0].label: of.reason for of in offers_for(gap_contrasts(one_task))}
    assert offers["unit task"] == "not possible: one task"
    each_suite = [*one_task, *play(result, "1", task="VideoUnmask")]
    each_suite += play(result, "0", task="VideoUnmask", setting="direct")
    assert "equal weights of suites" not in [one.label for one in gaps(each_suite)[0].others]
    mixed = play(result, "1111", processor="a") + play(
        result, "0000", setting="direct", processor="a"
    )
    other = play(result, "1111", task="BinFill", processor="b")
    other += play(result, "1111", task="BinFill", setting="direct", processor="b")
    labels = [one.label for one in gaps([*mixed, *other])[0].others]
    assert "one processor" in labels
    assert "seed 0" not in labels


def test_two_policies_are_compared_in_what_both_played(result) -> None:
    first = play(result, "1" * 20, task="BinFill") + play(result, "1" * 20)
    second = play(result, "0" * 20, task="BinFill") + play(result, "0" * 20)
    found = try_choices(policy_contrasts(first, [*second, *play(result, "1", setting="direct")]))
    assert [(one.label, one.verdict) for one in found] == [("explicit", "higher")]


@given(st.lists(st.sampled_from((-1, 0, 1)), min_size=1, max_size=12))
@settings(max_examples=60, deadline=None)
def test_swaps_of_equal_units_are_the_exact_test(differences: list[int]) -> None:
    whole = np.array(differences)
    assert swap_test(whole.astype(float)) == pytest.approx(sign_flip_test(whole))


def test_random_swaps_are_close_to_the_exact_test() -> None:
    whole = np.array([1] * 20 + [-1] * 9)
    assert swap_test(whole.astype(float)) == pytest.approx(sign_flip_test(whole), abs=0.015)


def test_few_uneven_units_are_all_swapped() -> None:
    values = np.array([0.5, 0.3, -0.1])
    sums = [sum(pair) for pair in itertools.product(*((-one, one) for one in values))]
    share = sum(abs(total) >= 0.7 - 1e-9 for total in sums) / len(sums)
    assert swap_test(values) == share


def test_the_table_names_what_changes_a_verdict(result) -> None:
    results = [
        *play(result, "1" * 20),
        *play(result, "0" * 20, setting="direct"),
        *play(result, "1" * 20, task="BinFill"),
        *play(result, "1" * 20, task="BinFill", setting="direct"),
    ]
    table = make_sensitivity_table(RunData.of([("run", results)]))
    (row,) = table.rows
    words = dict(zip((one.name for one in table.columns), row.entries, strict=True))
    assert row.name == "direct minus explicit"
    assert words["verdict"].word == "lower"
    assert words["in other analyses"].word == (
        "does not hold in 2 of 3: unit task (open), without PickXtimes (open)"
    )
    with pytest.raises(InvalidValueError, match="explicit and another setting"):
        make_sensitivity_table(RunData.of([("run", play(result, "11"))]))
