"""The share of the gap to explicit that a rewriter closes, of made-up results."""

from __future__ import annotations

import pytest
from flat_jobs import frame_of, make_results
from msgspec.structs import replace

from roboirg.analysis.measures.run_data import RunData
from roboirg.analysis.tables.rewriter_table import NO_SHARE, make_rewriter_table
from roboirg.core.errors import InvalidValueError
from roboirg.policies.by_name.finding import read_policy

SERVED = "openpi://localhost:8000"
ALONE = read_policy(SERVED, "alone")
RULES = read_policy(f"resolve:surface?policy={SERVED}", "rules")
OTHER = read_policy("resolve:surface?policy=mme-vla://localhost:8000", "other")


def results(ref, outcomes, setting, task="PickXtimes"):
    """One result of a policy a letter: 1 for a success, 0 for a failure."""
    made = make_results(outcomes, setting, policy=ref.name, task=task)
    return [replace(result, ref=ref) for result in made]


def rows_of(*made):
    table = make_rewriter_table(RunData(frame_of(*made)))
    return [(row.group, row.name, list(row.cells)) for row in table.rows]


def test_half_of_a_gap_is_closed_if_half_of_the_lost_episodes_are_won_back():
    """The policy alone wins 20 % of direct, behind a rewriter 60 %, and 100 % of explicit.

    Cells: episodes, these three rates, and the share of the gap that is closed, 40 of 80 points.
    """
    found = rows_of(
        results(ALONE, "1" * 20, "explicit"),
        results(ALONE, "1" * 4 + "0" * 16, "direct"),
        results(RULES, "1" * 12 + "0" * 8, "direct"),
    )

    ((setting, policy, cells),) = found
    assert (setting, policy) == ("direct", "rules")
    assert cells[:5] == ["20", "20", "60", "100", "50"]


def test_only_episodes_count_that_all_three_have():
    """18 of 20 and of 30; of them the policy alone wins none, and behind a rewriter all."""
    found = rows_of(
        results(ALONE, "1" * 20, "explicit"),
        results(ALONE, "0" * 18, "direct"),
        results(RULES, "1" * 30, "direct"),
    )

    assert found[0][2][:5] == ["18", "0", "100", "100", "100"]


def test_rates_are_means_over_the_tasks_that_all_three_have():
    """Behind a rewriter 100 % of PickXtimes and 0 % of BinFill; StopCube was not played alone."""
    found = rows_of(
        results(ALONE, "1" * 20, "explicit"),
        results(ALONE, "0" * 20, "direct"),
        results(RULES, "1" * 20, "direct"),
        results(ALONE, "1" * 10, "explicit", "BinFill"),
        results(ALONE, "0" * 10, "direct", "BinFill"),
        results(RULES, "0" * 10, "direct", "BinFill"),
        results(RULES, "0" * 10, "direct", "StopCube"),
    )

    assert found[0][2][:5] == ["30", "0", "50", "100", "50"]


def test_without_a_clear_gap_there_is_no_share():
    """95 % against 100 % of 20 episodes could be chance."""
    found = rows_of(
        results(ALONE, "1" * 20, "explicit"),
        results(ALONE, "1" * 19 + "0", "direct"),
        results(RULES, "1" * 20, "direct"),
    )

    assert found[0][2] == ["20", "95", "100", "100", NO_SHARE, "–"]


def test_a_rewriter_is_compared_with_its_own_policy_alone():
    with pytest.raises(InvalidValueError, match="alone and behind a rewriter"):
        rows_of(
            results(ALONE, "1" * 20, "explicit"),
            results(ALONE, "0" * 20, "direct"),
            results(OTHER, "1" * 20, "direct"),
        )
