"""What holds of every number that any table, page or call gives: whose rate, and its interval."""

from __future__ import annotations

import contextlib
from collections import namedtuple
from pathlib import Path

import pytest
from flat_jobs import frame_of, make_result, make_results
from hypothesis import given, settings
from hypothesis import strategies as st

import roboirg
from roboirg.analysis.measures.arm_figures import arm_figures
from roboirg.analysis.measures.breakdowns import BREAKDOWNS, break_down
from roboirg.analysis.measures.comparison import compare
from roboirg.analysis.measures.comparison_text import sentences
from roboirg.analysis.measures.failure_rates import measure_ends
from roboirg.analysis.measures.headline import measure_headline
from roboirg.analysis.measures.measure import ALL_TASKS, KEPT_APART
from roboirg.analysis.measures.run_data import RunData
from roboirg.analysis.page.matrix import notes as cell_notes
from roboirg.analysis.run_results import Results
from roboirg.analysis.tables.arm_table import make_arm_table
from roboirg.analysis.tables.diagnostic_tables import (
    make_breakdown_table,
    make_failure_table,
    make_forms_table,
    make_heard_table,
)
from roboirg.analysis.tables.paper_tables import make_table
from roboirg.analysis.tables.run_tables import make_run_tables
from roboirg.core.errors import InvalidValueError
from roboirg.stats.rates import points, whole_percent

TASKS = ("PickXtimes", "BinFill")

CHOICES = {
    "policy": ("one", "other"),
    "policy_version": ("a", "b"),
    "setting": ("explicit", "direct"),
    "form": ("implicit", "resolved"),
    "delivery": ("prompt", "turns"),
    "arm": ("told", "silent", "silent-empty", "scrambled"),
    "wordings": (None, "test"),
    "split": ("test", "val"),
    "max_steps": (40, 1300),
    "language_version": ("1", "2"),
    "environment_version": (1, 2),
}
"""Values of what no rate is over two of, unless it is asked for."""
ResultConditions = namedtuple("ResultConditions", CHOICES)
ANY_CONDITIONS = st.fixed_dictionaries(
    {name: st.sampled_from(values) for name, values in CHOICES.items()}
)
USUAL_CONDITIONS = ResultConditions(
    "one", "a", "direct", "implicit", "prompt", "told", None, "test", 40, "1", 1
)


@st.composite
def conditions_that_nearly_agree(draw):
    """Draw conditions of which each differs from the one before in one or two things.

    So they could be taken for each other: two that differ in the split alone, for example.
    """
    found = [
        draw(st.sampled_from([USUAL_CONDITIONS, USUAL_CONDITIONS._replace(setting="explicit")]))
    ]
    for other in draw(st.lists(ANY_CONDITIONS, min_size=1, max_size=5)):
        changed = draw(st.lists(st.sampled_from(list(CHOICES)), min_size=1, max_size=2))
        found.append(found[-1]._replace(**{name: other[name] for name in changed}))
    return list(dict.fromkeys(found))


def numbers_in_table(table, *names):
    """Yield the numbers of a table in some columns, or in all.

    Of an entry such as ``−33 (≠) 2…`` this is -33.0; empty entries and dashes have none.
    """
    for row in table.rows:
        for column, entry in zip(table.columns, row.entries, strict=True):
            word = entry.text.split(" ")[0].replace("−", "-").lstrip("±")
            if (not names or column.name in names) and word not in ("", "–"):
                yield float(word)


def all_rates_of(frame):
    """Yield every rate in percent, and every difference of two in points."""
    data = RunData(frame)
    for table in make_run_tables(frame):
        yield from numbers_in_table(table)
    yield from numbers_in_table(make_table("main", data))
    yield from numbers_in_table(
        make_breakdown_table(BREAKDOWNS["difficulty"], frame), "success", "gap"
    )
    yield from numbers_in_table(make_heard_table(data), "cut, %", "success, all", "success, heard")
    tables = {
        make_arm_table: ("first, %", "second, %", "difference"),
        make_forms_table: ("implicit − resolved",),
        make_failure_table: ("success", "execution", "gap to explicit"),
    }
    for make, names in tables.items():
        with contextlib.suppress(InvalidValueError):  # nothing to show
            yield from numbers_in_table(make(data), *names)
    for summary in data.summaries.values():
        yield 100 * float(summary.rate or 0)
    for rate in results_of(data).rates().values():
        yield 100 * rate


def results_of(data):
    """Return what a caller gets, of results that were never stored."""
    results = Results(Path())
    results.__dict__["_data"] = data
    return results


@st.composite
def results_that_end_alike_under_the_same_conditions(draw):
    """Draw results by their conditions: of each at least one, and all are won or all are lost."""
    places = st.lists(st.tuples(st.sampled_from(TASKS), st.integers(0, 2)), min_size=1, unique=True)
    found = {}
    for condition in draw(conditions_that_nearly_agree()):
        fields = condition._asdict()
        fields["prompt_verdict"] = draw(st.sampled_from(["heard", "cut"]))
        outcome = draw(st.sampled_from(["success", "failure"]))
        found[condition] = [
            make_result(outcome, episode, task=task, **fields) for task, episode in draw(places)
        ]
    return found


@settings(max_examples=60, deadline=None)
@given(results_that_end_alike_under_the_same_conditions())
def test_no_printed_rate_mixes_episodes_of_different_conditions(results_by_conditions):
    """Conditions are policy, setting, split, step limit and the like.

    All drawn results of the same conditions are won, or all are lost. So a rate of one condition is
    0 or 100 %, a gap of two is 0 or 100 points, and a number in between has mixed two conditions.
    """
    frame = frame_of(*results_by_conditions.values())

    rates = [abs(rate) for rate in all_rates_of(frame)]

    assert set(rates) <= {0, 100}


@settings(max_examples=30, deadline=None)
@given(results_that_end_alike_under_the_same_conditions())
def test_python_gives_the_results_of_each_condition_a_rate_of_their_own(results_by_conditions):
    """`Results.rates()` maps labels to rates; two conditions with one label would be one rate.

    Results without the instruction (other arms than *told*) are left out if there are any with it.
    """
    told = [conditions for conditions in results_by_conditions if conditions.arm == "told"]
    expected = told or results_by_conditions

    rates = results_of(RunData(frame_of(*results_by_conditions.values()))).rates()

    assert len(rates) == len(expected)


@settings(max_examples=30, deadline=None)
@given(
    results_that_end_alike_under_the_same_conditions(),
    st.lists(st.sampled_from([*KEPT_APART, "setting"]), unique=True),
)
def test_measure_refuses_to_mix_conditions_that_the_columns_do_not_keep_apart(
    results_by_conditions, some_columns
):
    """All drawn results of the same conditions are won, or all are lost.

    `KEPT_APART` names all columns that tell conditions apart: a group by them is of one condition,
    with a rate of 0 or 1. By some of them alone it is the same, or the call is refused.
    """
    frame = frame_of(*results_by_conditions.values())

    apart = roboirg.measure(frame, [*KEPT_APART, "setting"])
    try:
        by_some_columns = roboirg.measure(frame, some_columns)
    except InvalidValueError:
        by_some_columns = ()

    assert len(apart) == len(results_by_conditions)
    assert {row.rate for row in [*apart, *by_some_columns]} <= {0, 1}


def test_the_rate_over_tasks_is_the_same_in_the_terminal_on_the_page_and_in_python():
    """9 of 10 episodes of a task and 1 of 2 of another: a mean of 70 %, not 10 of 12."""
    first_task = make_results("0111111111")
    second_task = make_results("01", task="BinFill", policy_seed=1)
    data = RunData(frame_of(first_task, second_task))

    (table,) = make_run_tables(data.frame)
    (whole,) = (summary for key, summary in data.summaries.items() if key.scope == ALL_TASKS)

    assert [*numbers_in_table(table)][-1] == 70
    assert cell_notes(whole, "")[1].startswith("70 % success, mean of 2 tasks")
    assert results_of(data).rates() == {("listener", "explicit"): 0.7}


def intervals_of(measured):
    """Yield the intervals of a rate, and of the gaps to those next to it."""
    yield measured.interval
    for gap in (measured.gap, measured.second_gap):
        if gap is not None:
            yield from (gap.interval, gap.retention_interval)


def all_intervals_of(outcomes):
    """Return every interval that is measured of episodes with the same outcomes in three settings.

    They are those of rates, gaps, control arms, breakdowns, kinds of failure, and the headline.

    Args:
        outcomes: a letter for each episode, 1 if it is won and 0 if it is lost.
    """
    frame = frame_of(
        make_results(outcomes, "explicit"),
        make_results(outcomes, "direct"),
        make_results(outcomes, "reasoning"),
        make_results(outcomes, arm="silent"),
    )
    data = RunData(frame)
    measured = [*data.summaries.values(), *arm_figures(frame)]
    measured += break_down(frame, BREAKDOWNS["difficulty"])
    for ends in measure_ends(data, {ALL_TASKS}).values():
        measured += ends
    _, told_run = frame.names  # after that of the arm silent
    found = [measure_headline(data.cells, told_run, ("direct", "reasoning")).interval]
    for row in measured:
        found += intervals_of(row)
    return [interval for interval in found if interval is not None]


@pytest.mark.parametrize("outcomes", ["1" * 20, "0" * 20], ids=["all won", "all lost"])
def test_no_interval_has_a_width_of_zero_although_all_episodes_end_alike(outcomes):
    """20 episodes are played in each of three settings and without instruction.

    Would find a rate of 0 or 100 % that looks certain: the next episode may end otherwise.
    """
    intervals = all_intervals_of(outcomes)

    assert intervals
    for low, high in intervals:
        assert low < high


@pytest.mark.parametrize("outcomes", ["1", "0"], ids=["won", "lost"])
def test_a_single_episode_gives_no_interval(outcomes):
    """In each setting one episode of one task is played; an interval takes at least two."""
    assert all_intervals_of(outcomes) == []


def gap_and_interval(row):
    """Return two entries of a row of a breakdown: episodes, success, gap, 95 % interval, p."""
    _, _, gap, interval, _ = row.entries
    return gap.text, interval.text


@pytest.mark.parametrize(
    ("explicit", "direct", "interval"),
    [("1", "0", "too few episodes"), ("1" * 20, "0" * 20, "−100.0 to −66.4")],
    ids=["one episode", "20 episodes"],
)
def test_a_gap_in_a_breakdown_has_an_interval_or_the_reason_why_there_is_none(
    explicit, direct, interval
):
    """All explicit episodes are won (1), and the same ones lost (0) in direct: −100 points.

    −66.4 is the end of the score interval for 20 pairs that differ to the same side; Wilson's
    formula, 1 − 2 · 1.96² / (20 + 1.96²) = 67.8 %, is near it, without a correction for skewness.
    """
    frame = frame_of(make_results(explicit, "explicit"), make_results(direct, "direct"))

    table = make_breakdown_table(BREAKDOWNS["difficulty"], frame)

    row_of_explicit, row_of_direct = table.rows
    assert gap_and_interval(row_of_explicit) == ("–", "–")
    assert gap_and_interval(row_of_direct) == ("−100.0", interval)


def test_the_note_of_a_cell_says_if_there_are_too_few_episodes_for_an_interval():
    """One episode was played, and won (1). The note is that of the mean over all tasks."""
    data = RunData(frame_of(make_results("1")))

    (whole,) = (summary for key, summary in data.summaries.items() if key.scope == ALL_TASKS)

    assert "too few episodes" in cell_notes(whole, "")


def test_the_sentence_of_a_comparison_says_if_there_are_too_few_episodes_for_an_interval():
    """One episode, won by the listener and lost by the other policy."""
    listener = frame_of(make_results("1"))
    other = frame_of(make_results("0", policy="other"))

    *_, sentence = (
        line
        for line in sentences(compare(listener, other), "listener", "other")
        if line.startswith("explicit: ")
    )

    assert "+100.0 points (too few episodes)" in sentence


def test_halves_are_rounded_up_in_whole_percentages_and_away_from_0_in_gaps():
    """As in the paper's tables; to even, 1 of 8 would be 12 % in one place and 12.5 in another."""
    rates = [whole_percent(wins / 8) for wins in (1, 3, 5, 7)]
    gaps = [points(0.125), points(-0.125), points(0.0625, 1), points(-0.0625, 1)]

    assert rates == ["13", "38", "63", "88"]
    assert gaps == ["+13", "−13", "+6.3", "−6.3"]


def test_a_gap_that_rounds_to_zero_has_no_sign_of_its_own():
    assert points(-0.001) == "±0"
    assert points(0.0004, 1) == "±0.0"


def test_what_several_seeds_played_is_counted_in_trials_below_the_terminals_table():
    """One episode was played with policy seeds 0 and 1: two trials of one cell."""
    results = [make_result(policy_seed=seed) for seed in (0, 1)]

    (table,) = make_run_tables(frame_of(results))

    assert "n = 2 trials per cell" in table.notes[0]
