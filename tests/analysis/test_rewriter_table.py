"""The share of the gap to explicit that a rewriter closes, of made-up results."""

from __future__ import annotations

import pytest
from flat_jobs import frame_of, make_results
from msgspec.structs import replace

from roboirg.analysis.measures.run_data import RunData
from roboirg.analysis.tables.rewriter_table import NO_SHARE, make_rewriter_table
from roboirg.core.errors import InvalidValueError
from roboirg.policies.by_name.finding import read_policy

POLICY = read_policy("openpi://localhost:8000", "alone")
POLICY_BEHIND_REWRITER = read_policy("resolve:surface?policy=openpi://localhost:8000", "rules")
ANOTHER_POLICY_BEHIND_REWRITER = read_policy(
    "resolve:surface?policy=mme-vla://localhost:8000", "other"
)


def results_of(policy, setting, *, won, played=20, task="PickXtimes"):
    """Return results of a policy that wins the first so many of the episodes that it plays."""
    outcomes = "1" * won + "0" * (played - won)
    made = make_results(outcomes, setting, policy=policy.name, task=task)
    return [replace(result, ref=policy) for result in made]


def row_of(*results):
    """Return the one row of the table, a cell by the name of its column."""
    (row,) = make_rewriter_table(RunData(frame_of(*results))).rows
    assert (row.group, row.name) == ("direct", "rules")
    columns = ("episodes", "alone", "rewritten", "explicit", "gap closed", "interval")
    return dict(zip(columns, row.cells, strict=True))


def test_half_of_a_gap_is_closed_if_half_of_the_lost_episodes_are_won_back():
    """A policy wins 4 of 20 direct instructions alone, 12 behind a rewriter, and all explicit ones.

    These are 20 %, 60 % and 100 %. The gap is 80 points; the rewriter closes 40 of them, 50 %.
    """
    row = row_of(
        results_of(POLICY, "explicit", won=20),
        results_of(POLICY, "direct", won=4),
        results_of(POLICY_BEHIND_REWRITER, "direct", won=12),
    )

    assert row["alone"] == "20"
    assert row["rewritten"] == "60"
    assert row["gap closed"] == "50"


def test_only_episodes_count_that_all_three_have():
    """The 18 episodes played alone are also among the 20 explicit and the 30 rewritten ones.

    Of these 18 the policy alone wins none and behind a rewriter all: the whole gap is closed.
    """
    row = row_of(
        results_of(POLICY, "explicit", won=20),
        results_of(POLICY, "direct", won=0, played=18),
        results_of(POLICY_BEHIND_REWRITER, "direct", won=30, played=30),
    )

    assert row["episodes"] == "18"
    assert row["gap closed"] == "100"


def test_rates_are_means_over_the_tasks_that_all_three_have():
    """Behind a rewriter 100 % of PickXtimes and 0 % of BinFill are won: 50 %, a task like another.

    By episodes it would be 20 of 30. StopCube does not count: it was not played alone.
    """
    row = row_of(
        results_of(POLICY, "explicit", won=20),
        results_of(POLICY, "direct", won=0),
        results_of(POLICY_BEHIND_REWRITER, "direct", won=20),
        results_of(POLICY, "explicit", won=10, played=10, task="BinFill"),
        results_of(POLICY, "direct", won=0, played=10, task="BinFill"),
        results_of(POLICY_BEHIND_REWRITER, "direct", won=0, played=10, task="BinFill"),
        results_of(POLICY_BEHIND_REWRITER, "direct", won=0, played=10, task="StopCube"),
    )

    assert row["rewritten"] == "50"
    assert row["episodes"] == "30"


def test_without_a_clear_gap_there_is_no_share():
    """19 of 20 against 20 of 20 episodes could be chance, so there may be no gap to close."""
    row = row_of(
        results_of(POLICY, "explicit", won=20),
        results_of(POLICY, "direct", won=19),
        results_of(POLICY_BEHIND_REWRITER, "direct", won=20),
    )

    assert (row["gap closed"], row["interval"]) == (NO_SHARE, "–")


def test_a_rewriter_is_compared_with_its_own_policy_alone():
    """Here a rewriter stands before a policy on another server, which was not played alone."""
    with pytest.raises(InvalidValueError, match="alone and behind a rewriter"):
        row_of(
            results_of(POLICY, "explicit", won=20),
            results_of(POLICY, "direct", won=0),
            results_of(ANOTHER_POLICY_BEHIND_REWRITER, "direct", won=20),
        )
